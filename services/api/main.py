"""The composition root: settings in, application out. Importing this module does nothing.

Run it with `uvicorn services.api.main:create_app --factory`.
"""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI
from starlette.middleware.body_limit import RequestBodyLimitMiddleware

from hi5_common.db.engine import open_database
from hi5_common.queue.celery_doorbell import CeleryDoorbell
from hi5_common.settings import Settings
from hi5_common.storage.open import open_store
from hi5_common.version import hi5_version
from services.api import contract, errors
from services.api.access.doors import require_doors
from services.api.access.gate import Gate
from services.api.access.log_filter import hide_tokens
from services.api.access.routes import router as access
from services.api.arenas import share_arenas
from services.api.audit.routes import router as audit
from services.api.balance.routes import router as balance
from services.api.cards.routes import router as cards
from services.api.catalogue.routes import router as catalogue
from services.api.dashboard import pages
from services.api.dashboard.routes import router as dashboard
from services.api.datasets.routes import router as datasets
from services.api.failures.routes import router as failures
from services.api.head import Head
from services.api.health.routes import router as health
from services.api.images.routes import router as images
from services.api.manifest.routes import router as manifest
from services.api.objects.routes import router as objects
from services.api.parts import Parts
from services.api.plans.routes import router as plans
from services.api.settings import ApiSettings
from services.api.shield import Shield
from services.api.workers.routes import router as workers

ROUTERS = (
    datasets,
    manifest,
    balance,
    audit,
    failures,
    cards,
    images,
    objects,
    plans,
    catalogue,
    workers,
    health,
    dashboard,
    access,
)


def create_app() -> FastAPI:
    """Read the settings and open what they name; nothing is contacted before a request."""
    hide_tokens()
    share_arenas()
    settings = Settings()
    parts = Parts.of(
        settings,
        open_database(settings.resolved_database_url),
        open_store(settings),
        CeleryDoorbell(settings),
    )
    return assemble(parts, ApiSettings())


def assemble(parts: Parts, api_settings: ApiSettings) -> FastAPI:
    """Put an application together from its parts; it closes audits and database at its end."""

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        yield
        parts.audits.close()
        parts.database.dispose()

    app = FastAPI(
        title="hi5",
        summary="Balanced, fully labelled synthetic hand-pose datasets",
        version=hi5_version(),
        docs_url=None,  # both would load scripts from elsewhere
        redoc_url=None,
        redirect_slashes=False,
        lifespan=lifespan,
        responses=contract.EVERYWHERE,
    )
    app.state.parts = parts
    app.state.api_settings = api_settings
    app.state.gate = Gate(parts.database, api_settings)
    app.state.max_body_bytes = api_settings.max_body_bytes
    app.state.max_audit_images = api_settings.max_audit_images
    errors.install(app)
    require_doors(ROUTERS)
    for router in ROUTERS:
        app.include_router(router)
    contract.declare(app)
    app.mount("/static", pages.static_files(), name="static")
    # The last one added is the outermost: the shield sees answers of all the others.
    app.add_middleware(RequestBodyLimitMiddleware, max_body_size=api_settings.max_body_bytes)
    app.add_middleware(
        Shield,
        allowed_hosts=api_settings.allowed_hosts,
        max_body_bytes=api_settings.max_body_bytes,
    )
    app.add_middleware(Head)
    return app
