"""The container's healthcheck: `python -m services.api.healthcheck` exits 0 if /readyz says so."""

import os
import sys
import urllib.error
import urllib.request

TIMEOUT_S = 4.5


def main() -> int:
    """Ask the API on this machine; UVICORN_PORT is the port that uvicorn itself listens on."""
    url = f"http://127.0.0.1:{os.environ.get('UVICORN_PORT', '8000')}/readyz"
    try:
        with urllib.request.urlopen(url, timeout=TIMEOUT_S) as answer:
            return 0 if answer.status == 200 else 1
    except urllib.error.HTTPError as error:
        sys.stderr.write(error.read(2000).decode(errors="replace") + "\n")
    except OSError as error:
        sys.stderr.write(f"{url}: {error}\n")
    return 1


if __name__ == "__main__":
    sys.exit(main())
