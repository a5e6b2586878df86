"""What every package needs while it runs: threads, memory, progress, interrupts."""
