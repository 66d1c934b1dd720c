"""How Celery is set up, by the sender and the worker alike. docs/decisions/0011 says why."""

from typing import Any

from kombu.entity import Queue

from hi5_common.settings import Settings

KEY_PREFIX = "hi5:"


def celery_settings(settings: Settings) -> dict[str, Any]:
    """Return Celery's configuration: early acknowledgement, no results, nothing held back."""
    return {
        "broker_url": settings.broker_url,
        "broker_connection_retry_on_startup": True,
        "broker_connection_max_retries": None,
        "broker_transport_options": {
            "visibility_timeout": 600,
            "socket_timeout": 30,
            "socket_connect_timeout": 5,
            "socket_keepalive": True,
            "health_check_interval": 10,
            "global_keyprefix": KEY_PREFIX,
            "unacked_restore_throttle": 1,
        },
        "task_serializer": "json",
        "result_serializer": "json",
        "accept_content": ["json"],
        "result_accept_content": ["json"],
        "result_backend": None,
        "task_ignore_result": True,
        "task_track_started": False,
        # The lease in the database is the truth: a message is spent when a pool process takes it.
        "task_acks_late": False,
        "task_reject_on_worker_lost": False,
        "task_time_limit": None,
        "task_soft_time_limit": None,
        "task_queues": [Queue(settings.queue)],  # type: ignore[no-untyped-call]
        "task_default_queue": settings.queue,
        "task_create_missing_queues": False,
        "worker_prefetch_multiplier": 1,
        "worker_disable_prefetch": True,
        "worker_pool": "prefork",
        "worker_pool_start_method": "spawn",
        "worker_concurrency": settings.worker_slots,
        "worker_proc_alive_timeout": 60,
        "worker_max_tasks_per_child": 50,
        "worker_cancel_long_running_tasks_on_connection_loss": False,
        "worker_soft_shutdown_timeout": 0,
        "worker_send_task_events": False,
        "worker_enable_remote_control": False,
        "worker_hijack_root_logger": False,
        "worker_redirect_stdouts": False,
    }
