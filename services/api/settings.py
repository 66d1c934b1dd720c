"""The settings that only the API has; the rest are hi5_common.settings."""

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict

ANY_HOST = "*"


class ApiSettings(BaseSettings):
    """How the API meets the network, from HI5_API_* environment variables."""

    model_config = SettingsConfigDict(env_prefix="HI5_API_", extra="ignore", frozen=True)

    allowed_hosts: tuple[str, ...] = ("localhost", "127.0.0.1", "::1")
    """Host names a request may name (a JSON list); "*" takes any. Guards against DNS rebinding."""

    rate: str = Field("1200/minute", pattern=r"^[1-9][0-9]{0,8}/(second|minute|hour|day)$")
    """Requests that a key may make, over a moving window, of each process of the API."""

    key_cache_s: float = Field(5, ge=0, le=300)
    """Seconds that a key or session is not looked up again: a revocation may take as long."""

    session_s: float = Field(43_200, gt=0)
    """Seconds until a browser must sign in again."""

    secure_cookies: bool = False
    """Say so behind a proxy that speaks HTTPS: browsers then never send a session without it."""

    max_body_bytes: int = Field(1 << 20, ge=1024)
    """The largest request body; counted while it streams in, whatever it claims to be."""

    max_audit_images: int = Field(200_000, ge=0)
    """Delivered images of a dataset that the service audits at most; 0 leaves audits to `hi5`."""
