"""`python -m bench`: run everything."""

from bench import (
    calibration,
    dewarp,
    faults,
    flattening,
    layout,
    photo,
    scan_to_page,
    shading,
    turntable,
    variants,
    watch,
    ways_out,
    words,
)

if __name__ == "__main__":
    scan_to_page.main()
    layout.main()
    flattening.main()
    turntable.main()
    calibration.main()
    faults.main()
    variants.main()
    ways_out.main()
    watch.main()
    shading.main()
    photo.main()
    words.main([])
    dewarp.main()
