"""`hi5 watch`: follow a dataset."""

import json
import sys

from hi5_common.cli import following
from hi5_common.cli.options import (
    DataDirOption,
    DatasetArgument,
    JsonOption,
    KeyFileOption,
    UrlOption,
    dataset_id,
)
from hi5_common.cli.target import open_service


def watch(
    dataset: DatasetArgument,
    as_json: JsonOption = False,
    url: UrlOption = None,
    data_dir: DataDirOption = None,
    key_file: KeyFileOption = None,
) -> None:
    """Show progress, rate and time left; with --json one line a change. Ends when it is settled."""
    wanted = dataset_id(dataset)
    with open_service(url, data_dir, key_file) as service:
        if not as_json:
            following.require_complete(service, following.follow(service, wanted))
            return
        last = None
        for state in following.updates(service, wanted):
            line = json.dumps(following.progress_json(state))
            if line != last:
                sys.stdout.write(f"{line}\n")
                sys.stdout.flush()
            last = line
        following.require_complete(service, state)
