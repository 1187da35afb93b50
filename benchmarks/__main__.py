"""All benchmarks, one after the other: ``python -m benchmarks``."""

from benchmarks import gear_pair

if __name__ == "__main__":
    print(gear_pair.main())
