"""What a command file of View runs: its simulations, the model at each of them, and what is active."""
