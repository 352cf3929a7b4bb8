package lcm

import (
	"bytes"
	"encoding/binary"
	"net/netip"
	"strings"
	"time"
)

// Wire format: LCM 1.3.1, "UDP Multicast Protocol Description". Big-endian.
const (
	shortMagic    = 0x4C433032 // "LC02"
	fragmentMagic = 0x4C433033 // "LC03"
	shortHead     = 8
	fragmentHead  = 20

	longestChannel = 63              // bytes, without the NUL
	selfTest       = "LCM_SELF_TEST" // liblcm sends it to itself
)

const (
	maxSenders = 1024
	maxBytes   = 64 << 20 // of one message
	maxHeld    = 72 << 20 // of incomplete messages, with their administration
	maxAge     = 2 * time.Second
)

// Message is a complete message.
type Message struct {
	Channel string
	Data    []byte

	// When it was read from the socket. The instant of a reading is in the message itself.
	Received time.Time
	Sender   netip.AddrPort
}

// Assembler converts datagrams, in any order, to messages. It has no socket and no clock. Its memory is bounded for every input.
type Assembler struct {
	received  int64
	malformed int64
	lost      int64 // of removed senders, as repeated
	repeated  int64
	senders   map[netip.AddrPort]*sender
	uses      uint64
	partials  partials
}

type sender struct {
	numbers numbers
	used    uint64 // order of the last use
}

// NewAssembler returns an Assembler without messages.
func NewAssembler() *Assembler {
	return &Assembler{senders: map[netip.AddrPort]*sender{}, partials: newPartials()}
}

// Received returns the number of messages.
func (a *Assembler) Received() int64 {
	return a.received
}

// Malformed returns the number of datagrams that are not those of LCM.
func (a *Assembler) Malformed() int64 {
	return a.malformed
}

// Lost returns the number of messages of all senders that are missing.
func (a *Assembler) Lost() int64 {
	lost := a.lost
	for _, one := range a.senders {
		lost += one.numbers.lost
	}
	return lost
}

// Repeated returns the number of messages of all senders that came twice.
func (a *Assembler) Repeated() int64 {
	repeated := a.repeated
	for _, one := range a.senders {
		repeated += one.numbers.repeated
	}
	return repeated
}

// LostBySender returns the missing messages of each sender that has any.
func (a *Assembler) LostBySender() map[netip.AddrPort]int64 {
	lost := map[netip.AddrPort]int64{}
	for address, one := range a.senders {
		if one.numbers.lost > 0 {
			lost[address] = one.numbers.lost
		}
	}
	return lost
}

// Add returns the message that the datagram completes; false if there is none. The message keeps no reference to the datagram.
func (a *Assembler) Add(datagram []byte, from netip.AddrPort, at time.Time) (Message, bool) {
	if len(datagram) < shortHead {
		return a.refuse()
	}
	number := binary.BigEndian.Uint32(datagram[4:])
	switch binary.BigEndian.Uint32(datagram) {
	case shortMagic:
		channel, data := cutChannel(datagram[shortHead:])
		if channel == "" {
			return a.refuse()
		}
		return a.take(from, number, channel, append([]byte(nil), data...), at)
	case fragmentMagic:
		return a.addFragment(datagram, from, number, at)
	}
	return a.refuse()
}

func (a *Assembler) refuse() (Message, bool) {
	a.malformed++
	return Message{}, false
}

// cutChannel returns the channel, and what is behind its NUL. The channel is empty if there is none.
func cutChannel(text []byte) (string, []byte) {
	end := bytes.IndexByte(text, 0)
	if end < 1 || end > longestChannel {
		return "", nil
	}
	return string(text[:end]), text[end+1:]
}

// take counts a complete message, and returns it.
func (a *Assembler) take(from netip.AddrPort, number uint32, channel string, data []byte, at time.Time) (Message, bool) {
	a.numbersOf(from).receive(number, at)
	if channel == selfTest {
		return Message{}, false
	}
	a.received++
	return Message{Channel: strings.ToValidUTF8(channel, "\uFFFD"), Data: data, Received: at, Sender: from}, true
}

// numbersOf returns the numbers of a sender. If there are too many senders, the one that is silent for longest is removed.
func (a *Assembler) numbersOf(from netip.AddrPort) *numbers {
	a.uses++
	one := a.senders[from]
	if one == nil {
		if len(a.senders) >= maxSenders {
			a.removeSender()
		}
		one = &sender{}
		a.senders[from] = one
	}
	one.used = a.uses
	return &one.numbers
}

func (a *Assembler) removeSender() {
	var oldest netip.AddrPort
	least := a.uses
	for address, one := range a.senders {
		if one.used < least {
			oldest, least = address, one.used
		}
	}
	a.lost += a.senders[oldest].numbers.lost
	a.repeated += a.senders[oldest].numbers.repeated
	delete(a.senders, oldest)
}

func (a *Assembler) addFragment(datagram []byte, from netip.AddrPort, number uint32, at time.Time) (Message, bool) {
	part, ok := parseFragment(datagram)
	if !ok {
		return a.refuse()
	}
	a.numbersOf(from).expect(number, at)
	whole, err := a.partials.add(partialKey{from, number}, part, at)
	if err != nil {
		return a.refuse()
	}
	if whole == nil {
		return Message{}, false
	}
	return a.take(from, number, whole.channel, whole.joined, at)
}
