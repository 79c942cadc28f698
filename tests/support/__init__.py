"""What the tests share: worlds, drivers and boards to test against, synthetic recordings, where things lie."""
