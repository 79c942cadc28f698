"""Descriptors kept back for the stop: it needs sockets also when this process has used up all that it may have."""

import os

SPARE = 16  # the sockets of two ways, and what finding a host's address by its name opens for each


class SpareDescriptors:
    """Spare descriptors, held from `keep` until `release`, which may be called again and from any thread."""

    def __init__(self) -> None:
        self._held: list[int] = []

    def keep(self) -> None:
        """Take the descriptors. Raises OSError when there are none left."""
        try:
            while len(self._held) < SPARE:
                self._held.append(os.open(os.devnull, os.O_RDONLY))
        except OSError:
            self.release()
            raise

    def release(self) -> None:
        """Give them back, for whoever opens something next."""
        held, self._held = self._held, []
        for descriptor in held:
            os.close(descriptor)
