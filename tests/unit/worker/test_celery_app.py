"""The worker's main process stays light: what has threads is imported in pool processes only."""

import json
import subprocess
import sys

from hi5_common.queue.celery_settings import celery_settings
from hi5_common.settings import Settings

HEAVY = {"bpy", "obstore", "sqlalchemy", "psycopg", "pyarrow", "cv2"}


def test_the_main_process_imports_nothing_with_threads() -> None:
    script = (
        "import json, sys\n"
        "import services.worker.celery_app, services.worker.tasks\n"
        "print(json.dumps(sorted(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True)
    assert not HEAVY & set(json.loads(done.stdout))


def test_messages_are_spent_when_read_and_never_held_back() -> None:
    made = celery_settings(Settings(worker_slots=3, queue="hi5.gpu"))
    assert made["task_acks_late"] is False
    assert made["worker_disable_prefetch"] is True
    assert made["worker_pool_start_method"] == "spawn"
    assert made["result_backend"] is None
    assert made["worker_concurrency"] == 3
    assert [queue.name for queue in made["task_queues"]] == ["hi5.gpu"]
