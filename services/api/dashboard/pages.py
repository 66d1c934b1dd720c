"""Templates and static files, all of them our own: nothing is loaded from elsewhere."""

import functools
from pathlib import Path

from fastapi import Request, Response
from starlette.staticfiles import StaticFiles
from starlette.templating import Jinja2Templates

from hi5_common.fairness.page import TEMPLATES
from services.api.dashboard import words

_FOLDER = Path(__file__).parent


def static_files() -> StaticFiles:
    """Return the app that serves style and script, the audit's own style too."""
    return StaticFiles(directory=_FOLDER / "static", packages=[("hi5_common.fairness", "static")])


def page(request: Request, name: str, **values: object) -> Response:
    """Render a template; every value is escaped."""
    response = _templates().TemplateResponse(request, name, values)
    response.headers["Cache-Control"] = "no-store"
    return response


@functools.cache
def _templates() -> Jinja2Templates:
    found = Jinja2Templates(directory=[_FOLDER / "templates", TEMPLATES])
    found.env.filters.update(
        label=words.label,
        tone=words.tone,
        number=words.number,
        percent=words.percent,
        moment=words.moment,
    )
    return found
