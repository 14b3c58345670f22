"""What the paper prints."""

TABLE_III = {  # Hz, by payload [g]: link 1 modes 1 and 2, link 2 modes 1 and 2
    0: ((2, 35), (6, 32)),
    20: ((2, 27), (4, 25)),
    40: ((2, 23), (4, 23)),
    60: ((2, 22), (3, 21)),
    80: ((2, 20), (3, 20)),
    100: ((2, 19), (3, 19)),
}
