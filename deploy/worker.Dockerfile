# A render worker with Blender, and the keeper.
FROM python:3.13-slim-trixie AS build
WORKDIR /src
ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1
COPY locks/build.txt locks/worker.txt locks/
RUN pip install --require-hashes --no-deps -r locks/build.txt \
    && python -m venv --without-pip /opt/hi5 \
    && pip --python /opt/hi5/bin/python install --require-hashes --no-deps -r locks/worker.txt
COPY pyproject.toml LICENSE README.md ./
COPY hi5_common hi5_common
COPY services services
# Built here, by the pinned hatchling, and installed there: --python would build with there's.
RUN pip wheel --no-deps --no-index --no-build-isolation --wheel-dir /wheels . \
    && pip --python /opt/hi5/bin/python install --no-deps --no-index /wheels/*.whl

FROM python:3.13-slim-trixie
LABEL org.opencontainers.image.title="hi5-worker" org.opencontainers.image.licenses="GPL-3.0-or-later"
# What Blender's wheel links and does not carry; scripts/lib.bash has the same list.
RUN apt-get update \
    && apt-get install -y --no-install-recommends \
        libegl1 libgl1 libice6 libsm6 libx11-6 libxext6 libxfixes3 libxi6 libxkbcommon0 libxrender1 \
    && rm -rf /var/lib/apt/lists/*
# The home is a volume's mount point: a new volume takes its owner from here.
RUN useradd --uid 10001 --create-home --home-dir /var/lib/hi5 hi5
COPY --from=build /opt/hi5 /opt/hi5
ENV PATH=/opt/hi5/bin:$PATH HOME=/var/lib/hi5 PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1
WORKDIR /var/lib/hi5
USER 10001
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=15s --timeout=5s --retries=4 --start-period=60s \
    CMD ["python", "-m", "services.worker.healthcheck", "worker"]
CMD ["celery", "-A", "services.worker.celery_app", "worker", "--without-gossip", "--without-mingle", "--loglevel", "INFO"]
