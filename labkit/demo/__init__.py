"""In front of the room: every Stage in a full window, its question first, and the room's votes; it knows no chapter.

program    what is shown: the Stages and predictions of the chapters in the notebooks' order, own questions
notes      what the lecturer alone reads: what to show, what tempts, which mistakes are near
house      the Stages while they live: built ahead, moved in one thread, their pixels let go
session    what is shown at the moment, which all windows of the lecturer share
vote       ballots of two rounds, hidden while they are open
server     the lecturer's pages, on this machine
room       the phones' page: a second listener, there only with --vote
window     one Stage of a notebook on the same page
"""
