"""What is measured at each commit: `asv continuous --config benchmarks/asv.conf.json HEAD~1 HEAD`."""
