"""Work and precision: what each digit costs, by every method, timed in turn in one process."""
