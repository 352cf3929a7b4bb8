package lcm

import (
	"encoding/binary"
	"fmt"
	"net"
	"net/netip"
	"strings"
)

const (
	largestShort = 65_499                                  // bytes of channel, NUL and data in one datagram, as liblcm
	largestPart  = largestDatagram - 8 - 40 - fragmentHead // without the heads of UDP and IP
)

// Sender sends messages to the group of a URL. It belongs to one goroutine.
type Sender struct {
	prefix     string
	connection *net.UDPConn
	group      netip.AddrPort
	number     uint32
}

// NewSender opens a socket for the group of a URL. prefix precedes each channel.
func NewSender(url, prefix string) (*Sender, error) {
	where, err := ParseURL(url)
	if err != nil {
		return nil, err
	}
	index, err := interfaceIndex(where.Interface)
	if err != nil {
		return nil, err
	}
	connection, err := dial(where, index)
	if err != nil {
		return nil, err
	}
	return &Sender{prefix: prefix, connection: connection, group: netip.AddrPortFrom(where.Group, where.Port)}, nil
}

// Close closes the socket.
func (s *Sender) Close() error {
	return s.connection.Close()
}

// Publish sends an encoded message.
func (s *Sender) Publish(channel string, data []byte) error {
	name := s.prefix + channel
	if len(name) < 1 || len(name) > longestChannel || strings.IndexByte(name, 0) >= 0 {
		return fmt.Errorf("a channel has 1 to %d bytes without NUL, not %d: %q", longestChannel, len(name), name)
	}
	if len(data) > maxBytes {
		return fmt.Errorf("a message has at most %d bytes, not %d", maxBytes, len(data))
	}
	for _, datagram := range datagrams(s.number, name, data) {
		if _, err := s.connection.WriteToUDPAddrPort(datagram, s.group); err != nil {
			return err
		}
	}
	s.number++
	return nil
}

// datagrams returns the message as one short message, or as fragments.
func datagrams(number uint32, channel string, data []byte) [][]byte {
	if len(channel)+1+len(data) <= largestShort {
		datagram := binary.BigEndian.AppendUint32(nil, shortMagic)
		datagram = binary.BigEndian.AppendUint32(datagram, number)
		return [][]byte{append(appendChannel(datagram, channel), data...)}
	}
	first := largestPart - len(channel) - 1
	count := 1 + (len(data)-first+largestPart-1)/largestPart
	parts := make([][]byte, 0, count)
	for begin, end := 0, first; begin < len(data); begin, end = end, end+largestPart {
		if end > len(data) {
			end = len(data)
		}
		part := binary.BigEndian.AppendUint32(nil, fragmentMagic)
		part = binary.BigEndian.AppendUint32(part, number)
		part = binary.BigEndian.AppendUint32(part, uint32(len(data)))
		part = binary.BigEndian.AppendUint32(part, uint32(begin))
		part = binary.BigEndian.AppendUint16(part, uint16(len(parts)))
		part = binary.BigEndian.AppendUint16(part, uint16(count))
		if begin == 0 {
			part = appendChannel(part, channel)
		}
		parts = append(parts, append(part, data[begin:end]...))
	}
	return parts
}

func appendChannel(datagram []byte, channel string) []byte {
	return append(append(datagram, channel...), 0)
}
