"""Descriptors reserved for the sockets of a stop, in case this process has used up its limit."""

import os

SPARE_DESCRIPTORS = 16  # the sockets of two paths, and those of the host's name resolution for each


class SpareDescriptors:
    """Spare descriptors, reserved from `keep` until `release`, which may be called repeatedly and from any thread."""

    def __init__(self) -> None:
        self._descriptors: list[int] = []

    def keep(self) -> None:
        """Reserve the descriptors. Raise OSError if the system has none left."""
        try:
            while len(self._descriptors) < SPARE_DESCRIPTORS:
                self._descriptors.append(os.open(os.devnull, os.O_RDONLY))
        except OSError:
            self.release()
            raise

    def release(self) -> None:
        """Close the spare descriptors, so that sockets can be opened."""
        descriptors = self._descriptors
        self._descriptors = []
        for descriptor in descriptors:
            os.close(descriptor)
