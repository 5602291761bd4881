"""The control table of one servo as bytes: where a register lies, and what may be read or written.

Whether a value may be written is not known here, but who may write it where is. Where the manuals
are silent, a read that touches an undefined byte is refused as a whole.
"""

from __future__ import annotations

from antennate.hardware.dynamixel.packets import StatusError
from antennate.hardware.dynamixel.tables import GOALS, Register, Table


class Memory:
    """The bytes of a control table, indirect data included.

    A byte of indirect data is the byte at its indirect address, which as delivered is its own. A
    register that is written through indirect data has to be named there whole and in order.

    Args:
        table: The model.

    Attributes:
        table: The model.
        version: Counts the changes by `set`, so that what follows from them can be kept.
        settings: The same without changes of goals.
    """

    def __init__(self, table: Table) -> None:
        self.table = table
        self.version = self.settings = 0
        self._stored: bytes | None = None
        registers = table.registers.values()
        self._bytes = bytearray(max(r.address + r.size for r in registers))
        self._starts = {r.address: r for r in registers}
        self._where = {
            r.name: (slice(r.address, r.address + r.size), r.size, r.signed) for r in registers
        }
        self._values: dict[str, int] = {}
        self._defined = {a for r in registers for a in range(r.address, r.address + r.size)}
        for register in registers:
            self.set(register.name, register.default or 0)

    def get(self, name: str) -> int:
        """The value of a register."""
        return self._values[name]

    def set(self, name: str, value: int) -> None:
        """Change a register, whatever its access."""
        self.show(name, value)
        self.version += 1
        self.settings += name not in GOALS

    def show(self, name: str, value: int) -> None:
        """Change a register that only tells what happens, such as a present velocity."""
        where, size, signed = self._where[name]
        self._bytes[where] = value.to_bytes(size, "little", signed=signed)
        self._values[name] = value

    def read(self, address: int, length: int) -> tuple[StatusError, bytes]:
        """Bytes from an address on."""
        places = self._places(address, length)
        if not places or any(place not in self._defined for place in places):
            return StatusError.ACCESS, b""
        return StatusError.NONE, bytes(self._bytes[place] for place in places)

    def changes(
        self, address: int, data: bytes, locked: bool
    ) -> tuple[StatusError, list[tuple[Register, int]]]:
        """The registers that a write changes and their new values, or why there are none.

        Args:
            address: Where it begins.
            data: Whole registers.
            locked: Whether the EEPROM is locked.
        """
        places = self._places(address, len(data))
        found: list[tuple[Register, int]] = []
        at = 0
        while at < len(places) or not places:
            register = self._starts.get(places[at]) if places else None
            if register is None or not register.writable or (locked and register.eeprom):
                return StatusError.ACCESS, []
            end = at + register.size
            whole = range(register.address, register.address + register.size)
            if places[at:end] != list(whole):
                return StatusError.DATA_LENGTH, []
            found.append((register, register.decode(data[at:end])))
            at = end
        return StatusError.NONE, found

    def start(self, stored: bool) -> None:
        """Let the RAM be as after power-on; that of the backup if `stored`."""
        for register in self.table.registers.values():
            if not register.eeprom:
                self.set(register.name, register.default or 0)
        self.set("backup_ready", int(self._stored is not None))
        if stored:
            self.restore(ram_only=True)

    def store(self) -> None:
        """Make a backup."""
        self._stored = bytes(self._bytes)
        self.set("backup_ready", 1)

    def restore(self, ram_only: bool = False) -> None:
        """Take from the backup what one has, if there is one."""
        for register in self.table.registers.values():
            if self._stored and _backed_up(register) and not (ram_only and register.eeprom):
                where, _, _ = self._where[register.name]
                self.set(register.name, register.decode(self._stored[where]))

    def _places(self, address: int, length: int) -> list[int]:
        """Where the bytes from an address on really lie."""
        names = self.table.indirect
        return [
            int.from_bytes(self._bytes[names[a] : names[a] + 2], "little") if a in names else a
            for a in range(address, address + length)
        ]


def _backed_up(register: Register) -> bool:
    """A backup has the EEPROM, and of the RAM gains, profile and indirect addresses."""
    ram = ("gain", "profile_", "indirect_address_")
    return register.writable and (register.eeprom or any(part in register.name for part in ram))
