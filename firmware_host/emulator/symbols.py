"""Function names from an ELF file, for the location of a failure in the firmware."""

import io
from bisect import bisect_right

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection


class Symbols:
    """The functions of an image, by address. An ELF without a symbol table gives addresses only."""

    def __init__(self, elf: bytes) -> None:
        functions: dict[int, tuple[int, str]] = {}
        for section in ELFFile(io.BytesIO(elf)).iter_sections():
            if not isinstance(section, SymbolTableSection):
                continue
            for symbol in section.iter_symbols():
                if symbol["st_info"]["type"] == "STT_FUNC":
                    functions[symbol["st_value"] & ~1] = (symbol["st_size"], symbol.name)
        self._starts = sorted(functions)
        self._functions = [functions[start] for start in self._starts]

    def function(self, address: int) -> str | None:
        """Return the name of the function at `address`, or None."""
        index = bisect_right(self._starts, address) - 1
        if index < 0:
            return None
        size, name = self._functions[index]
        return name if address < self._starts[index] + max(size, 2) else None

    def describe(self, address: int) -> str:
        """Return the description of an address in the image, as in `0x08000412 in function usart_init`."""
        name = self.function(address)
        location = f"in function {name}" if name else "outside every function of the image"
        return f"0x{address & ~1:08X} {location}"
