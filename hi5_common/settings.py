"""Every setting of every process, from HI5_* environment variables or files that hold secrets."""

import os
import platform
import re
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, field_validator
from pydantic.fields import FieldInfo
from pydantic_settings import BaseSettings, PydanticBaseSettingsSource, SettingsConfigDict

PREFIX = "HI5_"
SECRET_FIELDS = (
    *("database_url", "broker_url", "s3_access_key_id", "s3_secret_access_key"),
    *("api_key", "admin_key"),
)
"""Settings that may also come from the file named by HI5_<NAME>_FILE."""

Seconds = Annotated[float, Field(gt=0)]


class RendererName(StrEnum):
    """What makes the pictures: Blender, or a drawing of discs for tests."""

    CYCLES = "cycles"
    FAKE = "fake"


class LogFormat(StrEnum):
    """How a line of log looks: for people, or one JSON object."""

    TEXT = "text"
    JSON = "json"


class Settings(BaseSettings):
    """What a process of hi5 needs to know about its surroundings.

    Times are seconds. A worker stops itself `fence_margin_s` before its lease can run out, so
    `renew_s` must leave room for two attempts at renewal.
    """

    model_config = SettingsConfigDict(env_prefix=PREFIX, extra="ignore", frozen=True)

    data_dir: Path = Field(default_factory=lambda: _xdg("XDG_DATA_HOME", ".local/share") / "hi5")
    cache_dir: Path = Field(default_factory=lambda: _xdg("XDG_CACHE_HOME", ".cache") / "hi5")
    assets_dir: Path | None = None
    """Panoramas the user added or fetched; None is `assets` in the data folder."""
    polyhaven_url: str = "https://api.polyhaven.com"
    scratch_dir: Path | None = None
    """Where attempts render to before they are packed; None is the system's temporary folder."""

    database_url: str = Field("", repr=False)
    broker_url: str = Field("redis://127.0.0.1:6379/0", repr=False)
    store_url: str = ""
    s3_endpoint: str | None = None
    s3_access_key_id: str | None = Field(None, repr=False)
    s3_secret_access_key: str | None = Field(None, repr=False)
    s3_region: str = "us-east-1"
    s3_allow_http: bool = False
    s3_public_endpoint: str | None = Field(None, pattern=r"^https?://[A-Za-z0-9.:_\[\]-]+$")
    """Where clients reach the S3 store themselves. With it the API answers for a shard's whole
    files with signed addresses; None, and it sends every byte itself."""
    signed_url_s: int = Field(300, ge=1, le=900)
    """How long a signed address can be used: at most 15 minutes."""

    api_key: str | None = Field(None, repr=False)
    """What the command `hi5` shows to the service."""
    admin_key: str | None = Field(None, repr=False)
    """A key that migrating makes known to the database, as an administrator's."""

    renderer: RendererName = RendererName.CYCLES
    child_module: str = Field("services.worker.render_child", pattern=r"^[A-Za-z_][\w.]*$")
    """The module that renders: any that speaks the render child's protocol."""
    render_threads: int = Field(default_factory=lambda: len(os.sched_getaffinity(0)), ge=1)
    device: str = Field("cpu", pattern=r"^(cpu|(optix|cuda|hip|oneapi|metal)(:.+)?)$")
    """Where Cycles traces paths: cpu, a kind of GPU (its first), or a kind and an id, as
    `hi5 doctor` lists them. What is not there is an error: nothing falls back to the CPU."""
    calibration: Path | None = None
    """The table of `hi5 bench calibrate` that max_error and seconds_per_image go by; None is the
    one that comes with hi5. Workers of one dataset must have the same: labels name it."""
    worker_slots: int = Field(1, ge=1)
    worker_name: str = Field(
        default_factory=lambda: re.sub(r"[^A-Za-z0-9_.-]", "-", platform.node())[:80] or "worker",
        pattern=r"^[A-Za-z0-9_.-]{1,80}$",
    )
    """The machine's name among those of the fleet; a block for bad work goes by it."""
    queue: str = "hi5.cpu"

    lease_s: Seconds = 60
    renew_s: Seconds = 15
    reconcile_s: Seconds = 10
    dispatch_s: Seconds = 1
    ring_s: Seconds = 30
    idle_poll_s: float = Field(20, gt=0, le=40)
    """A worker with a free slot asks the database itself about this often, a quarter more or less.
    At most 40: health takes a minute's silence for an illness."""
    log_format: LogFormat = LogFormat.TEXT

    max_rings: int = Field(64, ge=1)
    """The most doorbell messages that may wait in the broker at a time."""
    image_timeout_s: Seconds = 300
    """The longest time between two signs of progress of a render child."""
    drain_s: float = Field(60, ge=0)
    """A worker told to stop still finishes a shard that needs no longer than this."""
    child_images: int = Field(1000, ge=1)
    """After so many images a render child makes room for a fresh one."""
    child_memory_mb: int = Field(8192, ge=256)
    """A render child that has grown beyond this makes room for a fresh one, between two images."""
    child_memory_limit_mb: int = Field(12288, ge=256)
    """A render child that has grown beyond this is killed, and its image tried again."""
    canary: bool = True
    """Whether a worker must render a known scene right before it may claim a shard."""
    child_network: bool = False
    """Whether a render child may open network sockets; only a GPU driver may ever need them."""
    block_s: Seconds = 600
    """How long a machine claims nothing after three bad shards in a row; then twice that, and so
    on up to four hours."""
    sweep_s: Seconds = 300
    orphan_grace_s: float = Field(3600, ge=0)

    @field_validator("lease_s")
    @classmethod
    def _lease_is_renewable(cls, lease_s: float) -> float:
        if lease_s < 1:
            raise ValueError("lease_s must be at least 1 second: set HI5_LEASE_S to 60")
        return lease_s

    def model_post_init(self, _context: Any, /) -> None:
        """Refuse a renewal so slow that a healthy worker fences itself, and limits at odds."""
        if self.child_memory_limit_mb < self.child_memory_mb:
            raise ValueError(
                f"child_memory_limit_mb ({self.child_memory_limit_mb}) must be at least "
                f"child_memory_mb ({self.child_memory_mb}): raise HI5_CHILD_MEMORY_LIMIT_MB or "
                "lower HI5_CHILD_MEMORY_MB"
            )
        if self.renew_s >= self.lease_s - self.fence_margin_s:
            raise ValueError(
                f"renew_s ({self.renew_s}) must be below lease_s - {self.fence_margin_s:g} "
                f"({self.lease_s - self.fence_margin_s:g}): lower HI5_RENEW_S or raise HI5_LEASE_S"
            )

    @property
    def fence_margin_s(self) -> float:
        """How long before the lease could run out a worker without renewal stops itself."""
        return min(15.0, self.lease_s / 4)

    @property
    def resolved_database_url(self) -> str:
        """The database asked for, or an SQLite file in the data folder."""
        return self.database_url or f"sqlite:///{self.data_dir / 'hi5.sqlite'}"

    @property
    def resolved_store_url(self) -> str:
        """The object store asked for, or a folder in the data folder."""
        return self.store_url or (self.data_dir / "store").absolute().as_uri()

    @property
    def resolved_assets_dir(self) -> Path:
        """The folder of panoramas asked for, or one in the data folder."""
        return self.assets_dir or self.data_dir / "assets"

    @property
    def health_dir(self) -> Path:
        """Where long-running processes leave their sign of life."""
        return self.data_dir / "health"

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,  # noqa: ARG003
        file_secret_settings: PydanticBaseSettingsSource,  # noqa: ARG003
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """Take arguments first, then HI5_*, then HI5_*_FILE."""
        return init_settings, env_settings, _SecretFiles(settings_cls)


class _SecretFiles(PydanticBaseSettingsSource):
    """Reads HI5_<NAME>_FILE for the fields that may be secret (docker secrets)."""

    def get_field_value(self, field: FieldInfo, field_name: str) -> tuple[Any, str, bool]:  # noqa: ARG002
        variable = f"{PREFIX}{field_name.upper()}_FILE"
        path = os.environ.get(variable)
        if field_name not in SECRET_FIELDS or not path:
            return None, field_name, False
        try:
            return Path(path).read_text(encoding="utf-8").strip(), field_name, False
        except OSError as error:
            raise ValueError(f"{variable}: {path!r} cannot be read ({error.strerror})") from error

    def __call__(self) -> dict[str, Any]:
        found = {
            name: self.get_field_value(field, name)[0]
            for name, field in self.settings_cls.model_fields.items()
        }
        return {name: value for name, value in found.items() if value is not None}


def _xdg(variable: str, fallback: str) -> Path:
    return Path(os.environ.get(variable) or Path.home() / fallback)
