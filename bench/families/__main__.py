"""`python -m bench.families [--count 200] [--points 1000 5000] [--seed S]`: fresh sheets, by default of today."""

from __future__ import annotations

from bench.draws import draws_parser, seed_of_today
from bench.families.table import APPLICABLE, SLIM, run

COUNT = 200
POINTS = (1000, 5000)


def main(
    count: int = COUNT, points: tuple[int, ...] = POINTS, seed: int | None = None, without: tuple[str, ...] = ()
) -> None:
    """Print the table of each size, its seeds from the date of today on when none is given."""
    seed = seed or seed_of_today() * 1000
    for size in points:
        run(size, count, seed, without)


if __name__ == "__main__":
    parser = draws_parser(__doc__, COUNT)
    parser.add_argument("--points", type=int, nargs="+", default=POINTS)
    parser.add_argument("--without", nargs="+", choices=(APPLICABLE, SLIM), default=(), help="the slowest methods")
    options = parser.parse_args()
    main(options.count, tuple(options.points), options.seed, tuple(options.without))
