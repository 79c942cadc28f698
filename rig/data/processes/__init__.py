"""Reading files of others in a process of its own, and what ends processes."""
