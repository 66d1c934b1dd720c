import json
import logging

from hi5_common.logs import JsonLines, TextLines


def record(**extra: object) -> logging.LogRecord:
    logger = logging.getLogger("hi5.test")
    return logger.makeRecord(
        "hi5.test", logging.INFO, __file__, 1, "attempt %s", ("ended",), None, extra=extra
    )


def test_a_json_line_carries_the_records_own_fields() -> None:
    line = json.loads(JsonLines().format(record(action="published", shard=3)))
    assert line.pop("at").endswith("+00:00")
    assert line == {
        "level": "info",
        "logger": "hi5.test",
        "message": "attempt ended",
        "action": "published",
        "shard": 3,
    }


def test_a_text_line_names_them() -> None:
    line = TextLines().format(record(action="published", shard=3))
    assert line.endswith("INFO    hi5.test: attempt ended action=published shard=3")
