"""Services that every package uses at run time: threads, memory, progress, interrupts, temporary folders."""
