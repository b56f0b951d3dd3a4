"""`python -m bench`: run everything."""

from bench import bus_faults, calibration, dewarp, faults, flattening, photo, scan_to_page, shading, turntable, words

if __name__ == "__main__":
    scan_to_page.main()
    flattening.main()
    turntable.main()
    calibration.main()
    faults.main()
    bus_faults.main()
    shading.main()
    photo.main()
    words.main([])
    dewarp.main()
