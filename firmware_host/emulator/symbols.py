"""Function names from an ELF file, to say where in the firmware something happened."""

import io
from bisect import bisect_right
from collections.abc import Iterator

from elftools.elf.constants import SH_FLAGS
from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection


class Symbols:
    """The functions of an image, by address. An ELF without a symbol table gives addresses only."""

    def __init__(self, elf: bytes) -> None:
        functions: dict[int, tuple[int, str]] = {}
        marks: dict[int, str] = {}
        file = ELFFile(io.BytesIO(elf))
        self._sections = [
            (s["sh_addr"], s["sh_size"]) for s in file.iter_sections() if s["sh_flags"] & SH_FLAGS.SHF_EXECINSTR
        ]
        for section in file.iter_sections():
            if not isinstance(section, SymbolTableSection):
                continue
            for symbol in section.iter_symbols():
                if symbol["st_info"]["type"] == "STT_FUNC":
                    functions[symbol["st_value"] & ~1] = (symbol["st_size"], symbol.name)
                elif symbol.name in ("$t", "$d"):
                    marks[symbol["st_value"]] = symbol.name
        self._marks = marks
        self._starts = sorted(functions)
        self._functions = [functions[start] for start in self._starts]

    def code(self) -> Iterator[tuple[int, int]]:
        """Start and end of every stretch of instructions: literal pools and tables between them are left out."""
        starts = sorted(self._marks)
        for start, next_start in zip(starts, [*starts[1:], 1 << 32], strict=True):
            if self._marks[start] == "$t":
                yield start, min(next_start, self._section_end(start))

    def _section_end(self, address: int) -> int:
        return next((start + size for start, size in self._sections if start <= address < start + size), address)

    def function(self, address: int) -> str | None:
        """The function that `address` lies in."""
        index = bisect_right(self._starts, address) - 1
        if index < 0:
            return None
        size, name = self._functions[index]
        return name if address < self._starts[index] + max(size, 2) else None

    def where(self, address: int) -> str:
        """Where in the image an address lies, as in `0x08000412 in function usart_init`."""
        name = self.function(address)
        place = f"in function {name}" if name else "outside every function of the image"
        return f"0x{address & ~1:08X} {place}"
