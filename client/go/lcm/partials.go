package lcm

import (
	"container/list"
	"encoding/binary"
	"errors"
	"net/netip"
	"time"
)

// Bytes that the administration of one fragment takes.
const fragmentOverhead = 64

var errContradiction = errors.New("the fragments do not fit together")

// fragment is one part of a message. Only fragment 0 has a channel.
type fragment struct {
	size    uint32 // of the message
	offset  uint32
	index   uint16
	count   uint16
	channel string
	payload []byte
}

// parseFragment returns the parts of a datagram; false if they contradict each other.
func parseFragment(datagram []byte) (fragment, bool) {
	if len(datagram) < fragmentHead {
		return fragment{}, false
	}
	part := fragment{
		size:    binary.BigEndian.Uint32(datagram[8:]),
		offset:  binary.BigEndian.Uint32(datagram[12:]),
		index:   binary.BigEndian.Uint16(datagram[16:]),
		count:   binary.BigEndian.Uint16(datagram[18:]),
		payload: datagram[fragmentHead:],
	}
	if part.index == 0 {
		part.channel, part.payload = cutChannel(part.payload)
		if part.channel == "" {
			return fragment{}, false
		}
	}
	end := uint64(part.offset) + uint64(len(part.payload))
	return part, part.index < part.count && part.size <= maxBytes && end <= uint64(part.size)
}

type partialKey struct {
	sender netip.AddrPort
	number uint32
}

type piece struct {
	offset uint32
	data   []byte
}

// partial is a message of which fragments are missing.
type partial struct {
	key     partialKey
	size    uint32
	count   uint16
	channel string
	pieces  map[uint16]piece
	held    int
	begin   time.Time
	joined  []byte // when it is complete
}

// partials are the incomplete messages. Their memory is bounded: the oldest ones are removed.
type partials struct {
	byKey map[partialKey]*list.Element
	order *list.List // of *partial, oldest first
	held  int
}

func newPartials() partials {
	return partials{byKey: map[partialKey]*list.Element{}, order: list.New()}
}

// add returns the message if the fragment completes it, else nil.
func (p *partials) add(key partialKey, part fragment, at time.Time) (*partial, error) {
	p.expire(at)
	element := p.byKey[key]
	if element == nil {
		element = p.order.PushBack(&partial{key: key, size: part.size, count: part.count, pieces: map[uint16]piece{}, begin: at})
		p.byKey[key] = element
	}
	one := element.Value.(*partial)
	if one.size != part.size || one.count != part.count {
		return nil, errContradiction
	}
	p.held += one.add(part)
	if len(one.pieces) < int(one.count) {
		for p.held > maxHeld {
			p.drop(p.order.Front())
		}
		return nil, nil
	}
	p.drop(element)
	if err := one.join(); err != nil {
		return nil, err
	}
	return one, nil
}

// expire removes messages that stay incomplete.
func (p *partials) expire(at time.Time) {
	for oldest := p.order.Front(); oldest != nil; oldest = p.order.Front() {
		if at.Sub(oldest.Value.(*partial).begin).Abs() < maxAge {
			return
		}
		p.drop(oldest)
	}
}

func (p *partials) drop(element *list.Element) {
	one := p.order.Remove(element).(*partial)
	p.held -= one.held
	delete(p.byKey, one.key)
}

// add keeps a copy of a fragment that is not there yet. Returns the bytes that it takes.
func (p *partial) add(part fragment) int {
	if part.channel != "" {
		p.channel = part.channel
	}
	if _, known := p.pieces[part.index]; known {
		return 0
	}
	p.pieces[part.index] = piece{part.offset, append([]byte(nil), part.payload...)}
	taken := len(part.payload) + fragmentOverhead
	p.held += taken
	return taken
}

// join makes the message of its fragments, which must follow each other.
func (p *partial) join() error {
	joined := make([]byte, 0, p.size)
	for index := 0; index < int(p.count); index++ {
		one := p.pieces[uint16(index)]
		if int(one.offset) != len(joined) || len(joined)+len(one.data) > int(p.size) {
			return errContradiction
		}
		joined = append(joined, one.data...)
	}
	if len(joined) != int(p.size) {
		return errContradiction
	}
	p.joined = joined
	return nil
}
