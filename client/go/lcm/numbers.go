package lcm

import "time"

const (
	// Numbers that are remembered as received or missing.
	remembered = 4096

	// A larger jump begins a new numbering.
	farthestAhead = 1 << 24

	// Late messages from before the begin.
	stragglers = 64

	// A copy by the network comes sooner, a new program later.
	silence = 50 * time.Millisecond
)

// numbers counts the messages of one sender: which came, and how many are missing. They wrap around at 2^32.
//
// The first number is the begin; earlier messages are not missing. A number among the newest ones is late if it was missing (it is
// not lost any more), and otherwise repeated. A number further back, a larger jump ahead, and 0 after a silence begin a new
// numbering, because senders of LCM start at 0.
type numbers struct {
	lost     int64
	repeated int64
	begun    bool
	next     uint32
	span     int // remembered numbers before next
	missing  [remembered / 64]uint64
	last     time.Time
}

// receive counts a message.
func (n *numbers) receive(number uint32, at time.Time) {
	behind := n.place(number, at)
	if behind == 0 || behind > n.span {
		return
	}
	if n.isMissing(number) {
		n.setMissing(number, false)
		n.lost--
	} else {
		n.repeated++
	}
}

// expect counts a part of a message: the message is lost unless receive follows.
func (n *numbers) expect(number uint32, at time.Time) {
	if n.place(number, at) == 0 {
		n.setMissing(number, true)
		n.lost++
	}
}

// place returns 0 if the number is new, else how far it is behind the next one.
func (n *numbers) place(number uint32, at time.Time) int {
	if !n.begun {
		n.begin(number)
	}
	behind := int(int32(n.next - number))
	restarted := number == 0 && behind > 0 && at.Sub(n.last) >= silence
	if restarted || behind > n.span+stragglers || behind <= -farthestAhead {
		n.begin(number)
		behind = 0
	}
	n.last = at
	if behind > 0 {
		return behind
	}
	n.advance(number, -behind)
	return 0
}

// advance makes number the newest one, after skipped ones that are missing.
func (n *numbers) advance(number uint32, skipped int) {
	n.lost += int64(skipped)
	first := n.next
	if skipped > remembered {
		first = number - remembered
	}
	for missing := first; missing != number; missing++ {
		n.setMissing(missing, true)
	}
	n.setMissing(number, false)
	n.next = number + 1
	if n.span += skipped + 1; n.span > remembered {
		n.span = remembered
	}
}

func (n *numbers) begin(number uint32) {
	n.begun = true
	n.next = number
	n.span = 0
}

func (n *numbers) isMissing(number uint32) bool {
	place := number % remembered
	return n.missing[place/64]>>(place%64)&1 != 0
}

func (n *numbers) setMissing(number uint32, missing bool) {
	place := number % remembered
	if missing {
		n.missing[place/64] |= 1 << (place % 64)
	} else {
		n.missing[place/64] &^= 1 << (place % 64)
	}
}
