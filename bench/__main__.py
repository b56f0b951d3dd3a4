"""`python -m bench`: run everything."""

from bench import paper, peers, scan_to_page, words

if __name__ == "__main__":
    scan_to_page.main()
    paper.main()
    peers.main()
    words.main([])
