"""A process that parses scenes has no business on a network: the kernel refuses it one.

A seccomp filter, because it asks for no privilege: a container without CAP_SYS_ADMIN may not make
a network namespace. It cannot be taken off again, and whatever this process starts has it too.
"""

import ctypes
import errno
import os
import platform
import socket
import struct
from dataclasses import dataclass

_LOAD_WORD, _RETURN = 0x20, 0x06
_JUMP_EQUAL, _JUMP_AT_LEAST = 0x15, 0x35
_ALLOW, _ERRNO = 0x7FFF0000, 0x00050000
_AT_NUMBER, _AT_ARCH, _AT_FIRST_ARGUMENT = 0, 4, 16  # offsets in struct seccomp_data
_X32_BIT = 0x40000000
_IO_URING_SETUP = 425  # its rings open sockets without the call `socket`
_SET_MODE_FILTER, _ALL_THREADS = 1, 1
_PR_SET_NO_NEW_PRIVS = 38
_LOCAL_FAMILIES = (socket.AF_UNIX, socket.AF_NETLINK)  # what drivers and glibc talk over


@dataclass(frozen=True)
class _Machine:
    """The numbers of a kind of machine: its audit architecture and two system calls."""

    arch: int
    socket: int
    seccomp: int


_MACHINES = {
    "x86_64": _Machine(0xC000003E, 41, 317),
    "aarch64": _Machine(0xC00000B7, 198, 277),
}


class SeclusionRefused(Exception):
    """The kernel did not take the filter: this process can still reach the network."""


def refuse_network() -> None:
    """Take from every thread of this process, for good, all sockets but local ones.

    `socket` then fails with EACCES for any family but AF_UNIX and AF_NETLINK. Sockets that are
    open already stay so. Raises SeclusionRefused.
    """
    machine = _MACHINES.get(platform.machine())
    if machine is None:
        raise SeclusionRefused(f"the system calls of {platform.machine()} are not known to hi5")
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0):
        raise SeclusionRefused(_last_error("no_new_privs"))
    code = _program(machine)
    instructions = ctypes.create_string_buffer(code, len(code))
    program = struct.pack("HP", len(code) // 8, ctypes.addressof(instructions))
    if libc.syscall(machine.seccomp, _SET_MODE_FILTER, _ALL_THREADS, program):
        raise SeclusionRefused(_last_error("seccomp"))


def _program(machine: _Machine) -> bytes:
    """Return the filter in the kernel's classic BPF: jumps count instructions from the next."""
    count = len(_LOCAL_FAMILIES)
    local = [_step(_JUMP_EQUAL, family, count - i, 0) for i, family in enumerate(_LOCAL_FAMILIES)]
    return b"".join(
        [
            _step(_LOAD_WORD, _AT_ARCH),
            _step(_JUMP_EQUAL, machine.arch, 1, 0),
            _step(_RETURN, _ERRNO | errno.EPERM),
            _step(_LOAD_WORD, _AT_NUMBER),
            _step(_JUMP_AT_LEAST, _X32_BIT, 1, 0),
            _step(_JUMP_EQUAL, _IO_URING_SETUP, 0, 1),
            _step(_RETURN, _ERRNO | errno.ENOSYS),
            _step(_JUMP_EQUAL, machine.socket, 0, count + 2),
            _step(_LOAD_WORD, _AT_FIRST_ARGUMENT),
            *local,
            _step(_RETURN, _ERRNO | errno.EACCES),
            _step(_RETURN, _ALLOW),
        ]
    )


def _step(code: int, value: int, if_true: int = 0, if_false: int = 0) -> bytes:
    return struct.pack("HBBI", code, if_true, if_false, value)


def _last_error(what: str) -> str:
    return f"{what}: {os.strerror(ctypes.get_errno())}"
