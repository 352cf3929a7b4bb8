package lcm

import (
	"bytes"
	"encoding/binary"
	"encoding/hex"
	"net/netip"
	"testing"
	"time"
)

var (
	one   = netip.MustParseAddrPort("10.0.0.1:40001")
	other = netip.MustParseAddrPort("10.0.0.2:40001")
	begin = time.UnixMicro(0)
)

func fromHex(t *testing.T, text string) []byte {
	data, err := hex.DecodeString(text)
	if err != nil {
		t.Fatal(err)
	}
	return data
}

func fragmentOf(number uint32, size, offset, index, count int, rest string) []byte {
	part := binary.BigEndian.AppendUint32(nil, fragmentMagic)
	for _, value := range []uint32{number, uint32(size), uint32(offset), uint32(index)<<16 | uint32(count)} {
		part = binary.BigEndian.AppendUint32(part, value)
	}
	return append(part, rest...)
}

func TestMessagesOfStockLCM(t *testing.T) {
	// liblcm 1.3.1 of Debian 12: lcm_publish of 5 bytes, of none, and of 150,000 bytes whose heads are as captured.
	a := NewAssembler()
	message, complete := a.Add(fromHex(t, "4c43303200000000504f534954494f4e2f6178697331000102030405"), one, begin)
	if !complete || message.Channel != "POSITION/axis1" || !bytes.Equal(message.Data, []byte{1, 2, 3, 4, 5}) || message.Sender != one {
		t.Errorf("%+v", message)
	}
	message, complete = a.Add(fromHex(t, "4c43303200000001454d50545900"), one, begin)
	if !complete || message.Channel != "EMPTY" || len(message.Data) != 0 {
		t.Errorf("%+v", message)
	}
	data := bytes.Repeat([]byte{1, 2, 3}, 50_000)
	for index, head := range []string{"4c43303300000002000249f0000000000000000342494700", "4c43303300000002000249f00000ffcb00010003",
		"4c43303300000002000249f00001ff9a00020003"} {
		ends := []int{0, 65_483, 130_970, 150_000}
		message, complete = a.Add(append(fromHex(t, head), data[ends[index]:ends[index+1]]...), one, begin)
		if complete != (index == 2) {
			t.Errorf("fragment %d", index)
		}
	}
	if message.Channel != "BIG" || !bytes.Equal(message.Data, data) {
		t.Errorf("%s, %d bytes", message.Channel, len(message.Data))
	}
	if a.Received() != 3 || a.Lost() != 0 || a.Malformed() != 0 {
		t.Error(a.Received(), a.Lost(), a.Malformed())
	}
}

func TestOwnDatagramsInAnyOrder(t *testing.T) {
	a := NewAssembler()
	for number, size := range []int{0, 1, largestShort - 2, largestShort - 1, 200_000} {
		data := bytes.Repeat([]byte{byte(number)}, size)
		parts := datagrams(uint32(number), "A", data)
		for index := len(parts) - 1; index >= 0; index-- {
			message, complete := a.Add(parts[index], one, begin)
			if complete != (index == 0) || (complete && !bytes.Equal(message.Data, data)) {
				t.Errorf("%d bytes, fragment %d: %v", size, index, complete)
			}
		}
	}
	if a.Lost() != 0 {
		t.Error(a.Lost())
	}
}

func TestAMessageWithAMissingFragmentIsLost(t *testing.T) {
	a := NewAssembler()
	a.Add(datagrams(0, "A", nil)[0], one, begin)
	parts := datagrams(1, "BIG", make([]byte, 200_000))
	for _, part := range parts[1:] {
		a.Add(part, one, begin)
	}
	a.Add(datagrams(2, "A", nil)[0], one, begin)
	if lost := a.LostBySender(); a.Lost() != 1 || len(lost) != 1 || lost[one] != 1 {
		t.Error(a.Lost(), lost)
	}
	if _, complete := a.Add(parts[0], one, begin.Add(maxAge)); complete {
		t.Error("its other fragments are too old")
	}
}

func TestSendersDoNotMix(t *testing.T) {
	a := NewAssembler()
	a.Add(fragmentOf(7, 4, 0, 0, 2, "BIG\x00ab"), one, begin)
	a.Add(fragmentOf(7, 4, 0, 0, 2, "BIG\x00cd"), other, begin)
	second, _ := a.Add(fragmentOf(7, 4, 2, 1, 2, "gh"), other, begin)
	first, _ := a.Add(fragmentOf(7, 4, 2, 1, 2, "ef"), one, begin)
	if string(first.Data) != "abef" || string(second.Data) != "cdgh" {
		t.Error(string(first.Data), string(second.Data))
	}
}

func TestDatagramsThatAreNoMessages(t *testing.T) {
	for name, parts := range map[string][][]byte{
		"no head":                   {[]byte("LC02")},
		"another magic":             {[]byte("LC04\x00\x00\x00\x00A\x00")},
		"no channel":                {[]byte("LC02\x00\x00\x00\x00\x00abc")},
		"a channel without end":     {[]byte("LC02\x00\x00\x00\x00abc")},
		"a channel of 64 bytes":     {append([]byte("LC02\x00\x00\x00\x00"), append(bytes.Repeat([]byte("a"), 64), 0)...)},
		"no head of a fragment":     {fragmentOf(1, 4, 0, 0, 2, "")[:19]},
		"fragment 2 of 2":           {fragmentOf(1, 4, 0, 2, 2, "ab")},
		"behind its end":            {fragmentOf(1, 4, 3, 1, 2, "ab")},
		"offset and size overflow":  {fragmentOf(1, 4, 1<<32-1, 1, 2, "ab")},
		"larger than every message": {fragmentOf(1, maxBytes+1, 0, 1, 2, "ab")},
		"fragment 0 has no channel": {fragmentOf(1, 4, 0, 0, 2, "ab")},
		"overlapping":               {fragmentOf(1, 4, 0, 0, 2, "A\x00abc"), fragmentOf(1, 4, 2, 1, 2, "cd")},
		"a gap":                     {fragmentOf(1, 4, 0, 0, 2, "A\x00a"), fragmentOf(1, 4, 2, 1, 2, "cd")},
		"another size":              {fragmentOf(1, 4, 0, 0, 2, "A\x00ab"), fragmentOf(1, 5, 2, 1, 2, "cde")},
		"another count":             {fragmentOf(1, 4, 0, 0, 2, "A\x00ab"), fragmentOf(1, 4, 2, 1, 3, "cd")},
	} {
		a := NewAssembler()
		for _, part := range parts {
			if _, complete := a.Add(part, one, begin); complete {
				t.Errorf("%s: a message", name)
			}
		}
		if a.Malformed() != 1 {
			t.Errorf("%s: %d malformed", name, a.Malformed())
		}
	}
}

func TestMemoryIsBounded(t *testing.T) {
	a := NewAssembler()
	payload := string(make([]byte, 60_000))
	for number := uint32(0); number < 3_000; number++ { // 180 MB
		a.Add(fragmentOf(number, maxBytes, 100, 1, 2_000, payload), one, begin)
		if a.partials.held > maxHeld {
			t.Fatal(a.partials.held)
		}
	}
	for number := uint32(0); number < 5_000; number++ {
		a.Add(datagrams(0, "A", nil)[0], netip.AddrPortFrom(one.Addr(), uint16(number)), begin)
	}
	if len(a.senders) != maxSenders {
		t.Error(len(a.senders))
	}
	if a.partials.order.Len() != len(a.partials.byKey) {
		t.Error(a.partials.order.Len(), len(a.partials.byKey))
	}
	a.Add(fragmentOf(1<<31, 4, 0, 1, 2, "a"), one, begin.Add(maxAge))
	if a.partials.held != 1+fragmentOverhead {
		t.Error(a.partials.held)
	}
}

func TestARemovedSenderStaysCounted(t *testing.T) {
	a := NewAssembler()
	a.Add(datagrams(0, "A", nil)[0], one, begin)
	a.Add(datagrams(3, "A", nil)[0], one, begin)
	a.Add(datagrams(3, "A", nil)[0], one, begin)
	for port := uint16(0); port < maxSenders; port++ {
		a.Add(datagrams(0, "A", nil)[0], netip.AddrPortFrom(other.Addr(), port), begin)
	}
	if a.Lost() != 2 || a.Repeated() != 1 || len(a.LostBySender()) != 0 {
		t.Error(a.Lost(), a.Repeated(), a.LostBySender())
	}
}

// FuzzAdd checks that no datagrams make an Assembler panic or hold more than it may. Each byte 255 begins another datagram.
func FuzzAdd(f *testing.F) {
	f.Add(datagrams(1, "A", []byte("abc"))[0])
	f.Add(bytes.Join([][]byte{fragmentOf(1, 4, 0, 0, 2, "A\x00ab"), fragmentOf(1, 4, 2, 1, 2, "cd")}, []byte{255}))
	f.Fuzz(func(t *testing.T, data []byte) {
		a := NewAssembler()
		for index, datagram := range bytes.Split(data, []byte{255}) {
			a.Add(datagram, one, begin.Add(time.Duration(index)*time.Millisecond))
		}
		if a.partials.held > maxHeld || a.partials.held < 0 || a.partials.order.Len() != len(a.partials.byKey) {
			t.Fatal(a.partials.held)
		}
	})
}
