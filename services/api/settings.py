"""The settings that only the API has; the rest are hi5_common.settings."""

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict

ANY_HOST = "*"


class ApiSettings(BaseSettings):
    """How the API meets the network, from HI5_API_* environment variables."""

    model_config = SettingsConfigDict(env_prefix="HI5_API_", extra="ignore", frozen=True)

    allowed_hosts: tuple[str, ...] = ("localhost", "127.0.0.1", "::1")
    """Host names a request may name (a JSON list); "*" takes any. Guards against DNS rebinding."""

    max_body_bytes: int = Field(1 << 20, ge=1024)
    """The largest request body; counted while it streams in, whatever it claims to be."""

    max_audit_images: int = Field(200_000, ge=0)
    """Delivered images of a dataset that the service audits at most; 0 leaves audits to `hi5`."""
