"""hi5's Celery application, whose wait for a message (BRPOP) lasts until there is one."""

from services.worker.celery_app import app as app

app.conf.broker_transport_options |= {"polling_interval": 600}
