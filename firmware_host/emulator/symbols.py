"""Function names from an ELF file, to say where in the firmware something happened."""

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

    def where(self, address: int) -> str:
        """For example `0x08000412 in function usart_init`."""
        index = bisect_right(self._starts, address) - 1
        if index >= 0:
            size, name = self._functions[index]
            if address < self._starts[index] + max(size, 2):
                return f"0x{address:08X} in function {name}"
        return f"0x{address:08X}, outside every function of the image"
