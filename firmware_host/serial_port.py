"""A serial port or `socket://host:port`, by pyserial: bytes, and OSError for all that goes wrong."""

import os
import time

import serial

READ_TIMEOUT_S = 0.005  # the delay of every read: bytes come a few at a time, and each of them would wake the reader
_READ_SIZE = 65536


def why_closed(port: str, error: OSError) -> str:
    """Why `port` does not open, as the end of a sentence: in the system's words once, and which ports there are."""
    cause = next((each for each in (error, error.__context__) if isinstance(each, OSError) and each.errno), None)
    why = str(error) if cause is None or cause.errno is None else os.strerror(cause.errno)
    if "://" in port:
        return why
    from serial.tools import list_ports

    there = [f"{each.device} ({each.description})" for each in list_ports.comports()]
    return f"{why}; this computer has {', '.join(there) or 'no serial port'}"


class SerialPort:
    """An open port; raises OSError from the constructor, `read` and `write`."""

    def __init__(self, port: str, baud: int) -> None:
        try:
            self._serial = serial.serial_for_url(port, baudrate=baud, timeout=0, exclusive=True)
        except ValueError as error:  # what is no port's name, or no baud rate of it
            raise OSError(str(error)) from error

    def read(self) -> bytes:
        """What came within `READ_TIMEOUT_S`; when the port closes, what came before it first.

        pyserial would wait itself, but what it has read it drops when the port closes while it waits for more.
        """
        time.sleep(READ_TIMEOUT_S)
        return bytes(self._serial.read(_READ_SIZE))

    def write(self, data: bytes) -> None:
        """Send, whatever the far end makes of it."""
        self._serial.write(data)

    def close(self) -> None:
        """Close the port."""
        sock = getattr(self._serial, "_socket", None)
        if sock is not None:
            # pyserial would leave it open when the far end closed it first, and else wait 0.3 s after closing it.
            sock.close()
            self._serial.is_open = False
        self._serial.close()
