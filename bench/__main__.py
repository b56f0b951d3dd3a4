"""`python -m bench`: run everything."""

from bench import bus_faults, calibration, faults, paper, peers, scan_to_page, turntable

if __name__ == "__main__":
    scan_to_page.main()
    paper.main()
    peers.main()
    turntable.main()
    calibration.main()
    faults.main()
    bus_faults.main()
