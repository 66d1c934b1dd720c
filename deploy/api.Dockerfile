# The API, and the one-shot that migrates the database. No Blender in here.
FROM python:3.13-slim-trixie AS build
WORKDIR /src
ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1
COPY locks/build.txt locks/api.txt locks/
RUN pip install --require-hashes --no-deps -r locks/build.txt \
    && python -m venv --without-pip /opt/hi5 \
    && pip --python /opt/hi5/bin/python install --require-hashes --no-deps -r locks/api.txt
COPY pyproject.toml LICENSE README.md ./
COPY hi5_common hi5_common
COPY services services
# Built here, by the pinned hatchling, and installed there: --python would build with there's.
RUN pip wheel --no-deps --no-index --no-build-isolation --wheel-dir /wheels . \
    && pip --python /opt/hi5/bin/python install --no-deps --no-index /wheels/*.whl

FROM python:3.13-slim-trixie
LABEL org.opencontainers.image.title="hi5-api" org.opencontainers.image.licenses="GPL-3.0-or-later"
RUN useradd --uid 10001 --create-home --home-dir /var/lib/hi5 hi5
COPY --from=build /opt/hi5 /opt/hi5
ENV PATH=/opt/hi5/bin:$PATH HOME=/var/lib/hi5 PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1
WORKDIR /var/lib/hi5
USER 10001
EXPOSE 8000
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=5s --retries=6 --start-period=20s \
    CMD ["python", "-m", "services.api.healthcheck"]
ENV UVICORN_HOST=0.0.0.0 UVICORN_PORT=8000
CMD ["uvicorn", "services.api.main:create_app", "--factory", "--no-server-header", "--timeout-graceful-shutdown", "30"]
