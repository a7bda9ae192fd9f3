"""What a flight was: metrics, data frames, alignment by stamp, replay of its control laws."""
