# Shared by the scripts beside it; they stand in the repository's root when they source it.

say() { printf 'hi5: %s\n' "$*" >&2; }

stop() { # one clear line, then out
    say "$*"
    exit 1
}

# Runs apt-get install when this user may; returns non-zero when he may not or it fails.
apt_install() { # apt_install PACKAGE...
    command -v apt-get >/dev/null || return 1
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        sudo -n true 2>/dev/null || return 1
        as_root=(sudo -n)
    fi
    say "installing $* with apt-get"
    local log=.tools/apt.log
    mkdir -p .tools
    {
        "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -qq &&
            "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
                apt-get install -y -qq --no-install-recommends "$@"
    } </dev/null >"$log" 2>&1 || { tail -n 5 "$log" >&2 && return 1; }
}

# uv brings its own list of authorities; where the machine has one, that is the one its owner set.
trust_system_certificates() {
    local bundle
    for bundle in /etc/ssl/certs/ca-certificates.crt /etc/pki/tls/certs/ca-bundle.crt; do
        if [ -e "$bundle" ]; then export UV_SYSTEM_CERTS="${UV_SYSTEM_CERTS:-1}"; fi
    done
}

# Puts a working `uv` on PATH: the user's own, or a private one under .tools/uv.
need_uv() {
    trust_system_certificates
    command -v python3 >/dev/null || stop "python3 is missing; install it: apt-get install python3"
    if uv --version >/dev/null 2>&1; then return; fi
    # Only uv itself goes on PATH: the python3 of its private environment must not hide the machine's.
    export PATH="$PWD/.tools/bin:$PATH"
    if uv --version >/dev/null 2>&1; then return; fi
    say "installing uv into .tools/uv"
    install_uv_by_venv || install_uv_by_pip ||
        { apt_install python3-venv && install_uv_by_venv; } ||
        stop "python3 has neither venv nor pip; run: sudo apt-get install python3-venv"
    mkdir -p .tools/bin
    ln -sf ../uv/bin/uv .tools/bin/uv
    uv --version >/dev/null || stop "uv was installed into .tools/uv and does not run"
}

install_uv_by_venv() {
    rm -rf .tools/uv
    python3 -m venv .tools/uv >/dev/null 2>&1 || return 1
    .tools/uv/bin/python -m pip install --quiet --require-hashes --no-deps \
        -r locks/installer.txt >&2
}

# A python3 with pip and without venv, as some images have it.
install_uv_by_pip() {
    python3 -m pip --version >/dev/null 2>&1 || return 1
    rm -rf .tools/uv
    python3 -m pip install --quiet --require-hashes --no-deps --target .tools/uv \
        -r locks/installer.txt >&2
}

is_python_3_13() { # is_python_3_13 PATH
    [ -x "$1" ] && "$1" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 13))' >/dev/null 2>&1
}

# Prints the path of a Python 3.13, one already here before one fetched.
find_python_3_13() {
    local found candidate
    found=$(uv python find --system --no-project 3.13 2>/dev/null || true)
    for candidate in "$found" "${PYENV_ROOT:-$HOME/.pyenv}"/versions/3.13*/bin/python3.13; do
        if is_python_3_13 "$candidate"; then
            echo "$candidate"
            return
        fi
    done
    return 1
}

need_python_3_13() { # prints its path
    find_python_3_13 && return
    say "no Python 3.13 here; asking uv for one"
    uv python install --quiet 3.13 >&2 2>/dev/null && find_python_3_13 && return
    apt_install python3.13 && find_python_3_13 && return
    stop "hi5 needs Python 3.13 (Blender's wheel is built for it); run: uv python install 3.13"
}

# The libraries that the Blender wheel links and does not carry, with their Debian packages.
BLENDER_LIBRARIES=(
    libX11.so.6=libx11-6 libXext.so.6=libxext6 libXfixes.so.3=libxfixes3 libXi.so.6=libxi6
    libXrender.so.1=libxrender1 libSM.so.6=libsm6 libICE.so.6=libice6 libGL.so.1=libgl1
    libEGL.so.1=libegl1 libxkbcommon.so.0=libxkbcommon0
)

missing_blender_packages() { # missing_blender_packages PYTHON
    "$1" - "${BLENDER_LIBRARIES[@]}" <<'PY'
import ctypes
import sys

for pair in sys.argv[1:]:
    library, _, package = pair.partition("=")
    try:
        ctypes.CDLL(library)
    except OSError:
        print(package)
PY
}

need_blender_libraries() { # need_blender_libraries PYTHON
    local missing
    missing=$(missing_blender_packages "$1" | tr '\n' ' ')
    [ -n "$missing" ] || return 0
    # shellcheck disable=SC2086  # a list of package names
    apt_install $missing || true
    missing=$(missing_blender_packages "$1" | tr '\n' ' ')
    [ -z "$missing" ] || stop "Blender needs shared libraries; run: sudo apt-get install ${missing% }"
}
