"""What one servo does with an instruction for it, and whether it answers.

Source: https://emanual.robotis.com/docs/en/dxl/protocol2/, section Instruction Details.
"""

from __future__ import annotations

from collections.abc import Sequence

from dynamixel_bus.packets import (
    BROADCAST,
    HEADER,
    LAST_ID,
    Instruction,
    Packet,
    Status,
    StatusError,
    crc16,
)
from dynamixel_bus.servo import Servo

CONTROL_TABLE_BACKUP = 0x20
"""Instruction that stores registers, or restores them."""
_CLEAR = b"\x01DXL\x22"
_STORE, _RESTORE = b"\x01CTRL", b"\x02CTRL"
_RESET_EXCEPTIONS = {0xFF: (), 0x01: ("id",), 0x02: ("id", "baud_rate")}
"""What a factory reset leaves as it is, by its parameter."""
_RESET_ALL = 0xFF


def is_for(servo: Servo, packet: Packet) -> bool:
    """The packet is for this servo, by its id, its secondary id or as a broadcast."""
    return packet.id in (servo.get("id"), BROADCAST) or is_shadow(servo, packet)


def is_shadow(servo: Servo, packet: Packet) -> bool:
    """The packet is for this servo by its secondary id alone."""
    return packet.id <= LAST_ID and packet.id == servo.get("secondary_id") != servo.get("id")


def answer(t: float, servo: Servo, packet: Packet) -> Status | None:
    """Do what a packet for this servo asks at time t [s]; its answer, None if it gives none."""
    level = servo.get("status_return_level")
    quiet = packet.id == BROADCAST or is_shadow(servo, packet)
    if packet.instruction == Instruction.PING:
        data = b"".join(
            servo.model[r].encode(servo.get(r)) for r in ("model_number", "firmware_version")
        )
        return None if is_shadow(servo, packet) else status(servo, StatusError.NONE, data)
    if packet.instruction == Instruction.READ:
        return (
            status(servo, *servo.read(*two_words(packet.params))) if level and not quiet else None
        )
    name = servo.get("id")
    error = _change(t, servo, packet)
    return status(servo, error, b"", name) if level >= 2 and not quiet else None


def status(servo: Servo, error: StatusError, data: bytes, name: int | None = None) -> Status:
    """The answer of a servo, in the name of the id that it had when it was asked."""
    name = servo.get("id") if name is None else name
    return Status(name, error, servo.get("hardware_error_status") != 0, data)


def two_words(params: bytes) -> tuple[int, int]:
    """Address and length."""
    return int.from_bytes(params[:2], "little"), int.from_bytes(params[2:4], "little")


def fast_pieces(asked: int, answers: Sequence[Status]) -> list[bytes]:
    """What each servo adds to the one reply to a fast bulk read.

    Args:
        asked: Bytes of data that were asked for, plus four for each servo.
        answers: Of the servos that answer, in turn.
    """
    pieces: list[bytes] = []
    crc = 0
    for reply in answers:
        head = HEADER + bytes([BROADCAST]) + (asked + 1).to_bytes(2, "little") + b"\x55"
        piece = b"" if pieces else head
        piece += bytes([reply.error_byte, reply.id]) + reply.data
        crc = crc16(piece, crc)
        end = crc.to_bytes(2, "little")
        crc = crc16(end, crc)
        pieces.append(piece + end)
    return pieces


def _change(t: float, servo: Servo, packet: Packet) -> StatusError:
    params, kind = packet.params, packet.instruction
    if kind in (Instruction.WRITE, Instruction.REG_WRITE) and len(params) > 2:
        return _write(servo, packet)
    if kind == Instruction.ACTION and servo.registered is not None:
        registered, servo.registered = servo.registered, None
        servo.set("registered_instruction", 0)
        return servo.write(*registered)
    if kind == Instruction.REBOOT:
        servo.restart(t)
        return StatusError.NONE
    if kind == Instruction.CLEAR and params == _CLEAR:
        return servo.clear_turns()
    if kind == Instruction.FACTORY_RESET and params and params[0] in _RESET_EXCEPTIONS:
        if packet.id != BROADCAST or params[0] != _RESET_ALL:
            servo.factory_reset(t, _RESET_EXCEPTIONS[params[0]])
        return StatusError.NONE
    if kind == CONTROL_TABLE_BACKUP and params == _STORE:
        return servo.store_backup()
    if kind == CONTROL_TABLE_BACKUP and params == _RESTORE:
        return servo.restore_backup()
    return StatusError.INSTRUCTION


def _write(servo: Servo, packet: Packet) -> StatusError:
    """Write now, or register the write for an Action if it could be done now."""
    address, data = int.from_bytes(packet.params[:2], "little"), packet.params[2:]
    shadow = is_shadow(servo, packet)
    if packet.instruction == Instruction.WRITE:
        return servo.write(address, data, ram_only=True) if shadow else servo.write(address, data)
    error = servo.refuses(address, data, shadow)
    if not error:
        servo.registered = (address, data)
        servo.set("registered_instruction", 1)
    return error
