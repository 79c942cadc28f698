"""A serial port or `socket://host:port`, by pyserial: bytes, with OSError for all errors."""

import os
import time
from contextlib import suppress

READ_TIMEOUT_S = 0.005  # the delay of every read: bytes come a few at a time, and each would wake the reader
_READ_SIZE = 65536
_MAX_READS = 64  # more than any buffer holds: a device that sends without end must not hold the reader


def explain_closed(port: str, error: OSError) -> str:
    """Return why `port` does not open, as the end of a sentence: the system's reason, and the computer's ports."""
    cause = next(
        (failure for failure in (error, error.__context__) if isinstance(failure, OSError) and failure.errno), None
    )
    reason = str(error) if cause is None or cause.errno is None else os.strerror(cause.errno)
    if "://" in port:
        return reason
    return "; ".join(filter(None, [reason, describe_ports()]))


def describe_ports() -> str:
    """Return a clause on the serial ports of this computer; "" if they cannot be listed."""
    try:
        ports = find_ports()
    except ImportError:
        return ""
    return f"this computer has {', '.join(ports.values()) or 'no serial port'}"


def find_ports() -> dict[str, str]:
    """Return a description of each serial port with a device, by port. Raise ImportError without pyserial."""
    from serial.tools.list_ports import comports

    ports = [port for port in sorted(comports()) if port.hwid != "n/a"]  # else a name without a device behind it
    return {port.device: f"{port.device} ({port.description})" for port in ports}


class SerialPort:
    """An open port; constructor, `read` and `write` raise OSError."""

    def __init__(self, port: str, baud: int) -> None:
        try:
            import serial  # which a computer without serial ports may lack: to read recordings it is not needed
        except ImportError as error:
            raise OSError(f"pyserial cannot be loaded ({error})") from error
        try:
            self._serial = serial.serial_for_url(port, baudrate=baud, timeout=0, exclusive=True)
        except ValueError as error:  # an invalid name, or an unsupported baud rate
            raise OSError(str(error)) from error

    def read(self) -> bytes:
        """Return all data received within `READ_TIMEOUT_S`; if the port closes, first return the data received before.

        pyserial could wait itself, but loses data that it has read if the port closes during the wait.
        """
        time.sleep(READ_TIMEOUT_S)
        data = bytearray(self._serial.read(_READ_SIZE))
        with suppress(OSError):  # of a port that has closed: the next read raises it
            for _ in range(_MAX_READS):
                if not self._serial.in_waiting:
                    break
                data += self._serial.read(_READ_SIZE)
        return bytes(data)

    def write(self, data: bytes) -> None:
        """Send data, without confirmation by the far end."""
        self._serial.write(data)

    def close(self) -> None:
        """Close the port."""
        sock = getattr(self._serial, "_socket", None)
        if sock is not None:
            # pyserial leaves it open if the far end has closed it first, and otherwise waits 0.3 s after closing it.
            sock.close()
            self._serial.is_open = False
        self._serial.close()
