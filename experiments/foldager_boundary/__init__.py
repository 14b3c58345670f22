"""What holds the root of a link that a motor drives?"""
