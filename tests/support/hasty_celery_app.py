"""hi5's Celery application with a visibility timeout far shorter than any task."""

from services.worker.celery_app import app as app

app.conf.broker_transport_options |= {
    "visibility_timeout": 1,
    "unacked_restore_interval": 1,
    "unacked_restore_throttle": 1,
}
