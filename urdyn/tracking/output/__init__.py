"""What a run gives: history and checkpoint on disk, progress and summary, live topics."""
