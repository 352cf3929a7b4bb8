// Package lcm receives and sends LCM messages over UDP multicast, without liblcm. It needs Linux.
package lcm

import (
	"net"
	"net/netip"
	"strings"
	"time"
)

const largestDatagram = 65_535

// Receiver receives the messages of a group, from all senders. It belongs to one goroutine; only Close may be called by another one.
type Receiver struct {
	prefix     string
	connection *net.UDPConn
	buffer     []byte
	assembler  *Assembler
}

// NewReceiver joins the group of a URL. Call it before the messages that must not be missed are sent.
//
// prefix is that of the machine's channels (`lcm: {prefix: press3.}`): only these are received, without the prefix.
func NewReceiver(url, prefix string) (*Receiver, error) {
	where, err := ParseURL(url)
	if err != nil {
		return nil, err
	}
	index, err := interfaceIndex(where.Interface)
	if err != nil {
		return nil, err
	}
	connection, err := listen(where, index)
	if err != nil {
		return nil, err
	}
	return &Receiver{prefix: prefix, connection: connection, buffer: make([]byte, largestDatagram), assembler: NewAssembler()}, nil
}

// Close closes the socket. A Receive that waits returns net.ErrClosed.
func (r *Receiver) Close() error {
	return r.connection.Close()
}

// SetDeadline sets the time at which Receive returns os.ErrDeadlineExceeded. The zero time: never.
func (r *Receiver) SetDeadline(deadline time.Time) error {
	return r.connection.SetReadDeadline(deadline)
}

// Receive waits for the next message, in the order in which they are complete.
func (r *Receiver) Receive() (Message, error) {
	for {
		size, from, err := r.connection.ReadFromUDPAddrPort(r.buffer)
		if err != nil {
			return Message{}, err
		}
		from = netip.AddrPortFrom(from.Addr().Unmap(), from.Port())
		message, complete := r.assembler.Add(r.buffer[:size], from, time.Now())
		if !complete || !strings.HasPrefix(message.Channel, r.prefix) {
			continue
		}
		message.Channel = message.Channel[len(r.prefix):]
		return message, nil
	}
}

// Received returns the number of messages since the start, also of other channels.
func (r *Receiver) Received() int64 {
	return r.assembler.Received()
}

// Lost returns the number of messages that senders have sent and this receiver has not received, by the gaps in their numbers.
func (r *Receiver) Lost() int64 {
	return r.assembler.Lost()
}

// LostBySender returns the lost messages of each sender that has any.
func (r *Receiver) LostBySender() map[netip.AddrPort]int64 {
	return r.assembler.LostBySender()
}
