"""The procedures a technician runs: short scripts that read like the instruction on the wall."""
