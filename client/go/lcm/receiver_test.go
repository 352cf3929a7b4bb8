package lcm

import (
	"bytes"
	"errors"
	"net"
	"os"
	"testing"
	"time"
)

// The tests send on lo: they need a multicast route (ip route add 224.0.0.0/4 dev lo).

func receiverOf(t *testing.T, url, prefix string) *Receiver {
	receiver, err := NewReceiver(url, prefix)
	if err != nil {
		t.Fatal(err)
	}
	t.Cleanup(func() { receiver.Close() })
	if err := receiver.SetDeadline(time.Now().Add(10 * time.Second)); err != nil {
		t.Fatal(err)
	}
	return receiver
}

func senderOf(t *testing.T, url, prefix string) *Sender {
	sender, err := NewSender(url, prefix)
	if err != nil {
		t.Fatal(err)
	}
	t.Cleanup(func() { sender.Close() })
	return sender
}

func publish(t *testing.T, sender *Sender, channel string, data []byte) {
	if err := sender.Publish(channel, data); err != nil {
		t.Fatal(err)
	}
}

func receive(t *testing.T, receiver *Receiver) Message {
	message, err := receiver.Receive()
	if err != nil {
		t.Fatal(err)
	}
	return message
}

func TestInterfaces(t *testing.T) {
	for _, name := range []string{"lo", "127.0.0.1", "127.0.0.0/8"} {
		url := Default + "&interface=" + name
		receiver, sender := receiverOf(t, url, ""), senderOf(t, url, "")
		publish(t, sender, "A", []byte(name))
		if message := receive(t, receiver); string(message.Data) != name {
			t.Errorf("%s: %s", name, message.Data)
		}
	}
	for _, name := range []string{"eth77", "10.99.0.0/16"} {
		if _, err := NewReceiver(Default+"&interface="+name, ""); err == nil {
			t.Errorf("there is no interface %s", name)
		}
		if _, err := NewSender(Default+"&interface="+name, ""); err == nil {
			t.Errorf("there is no interface %s", name)
		}
	}
}

func TestIPv6(t *testing.T) {
	where := os.Getenv("AXLECAST_IPV6_INTERFACE")
	if where == "" {
		t.Skip("AXLECAST_IPV6_INTERFACE names an interface with IPv6 and multicast")
	}
	for _, group := range []string{"ff15::6c63:6d", "ff02::6c63:6d"} {
		url := "udpm://[" + group + "]:7667?ttl=0&interface=" + where
		receiver, sender := receiverOf(t, url, ""), senderOf(t, url, "")
		data := bytes.Repeat([]byte{7}, 100_000)
		publish(t, sender, "A", data)
		if message := receive(t, receiver); !bytes.Equal(message.Data, data) || !message.Sender.Addr().Is6() {
			t.Errorf("%d bytes from %s", len(message.Data), message.Sender)
		}
	}
}

func TestPrefixesAndOtherGroups(t *testing.T) {
	receiver := receiverOf(t, Default, "press3.")
	own, foreign := senderOf(t, Default, "press3."), senderOf(t, Default, "press4.")
	publish(t, own, "A", []byte("1"))
	publish(t, foreign, "A", []byte("2"))
	publish(t, senderOf(t, "udpm://239.255.76.68:7667", "press3."), "A", []byte("3"))
	publish(t, own, "B", []byte("4"))
	first, second := receive(t, receiver), receive(t, receiver)
	if first.Channel != "A" || string(first.Data) != "1" || second.Channel != "B" || string(second.Data) != "4" {
		t.Errorf("%+v %+v", first, second)
	}
	if receiver.Received() != 3 || receiver.Lost() != 0 {
		t.Error(receiver.Received(), receiver.Lost())
	}
}

func TestTwoReceiversOfOneGroup(t *testing.T) {
	first, second, sender := receiverOf(t, Default, ""), receiverOf(t, Default, ""), senderOf(t, Default, "")
	publish(t, sender, "A", []byte("1"))
	if string(receive(t, first).Data) != "1" || string(receive(t, second).Data) != "1" {
		t.Error("one of them receives")
	}
}

func TestAFullBufferIsCounted(t *testing.T) {
	receiver, sender := receiverOf(t, Default+"&recv_buf_size=4096", ""), senderOf(t, Default, "")
	for number := 0; number < 2_000; number++ {
		publish(t, sender, "A", make([]byte, 500))
	}
	received := int64(0)
	for ; ; received++ {
		receiver.SetDeadline(time.Now().Add(300 * time.Millisecond))
		if _, err := receiver.Receive(); errors.Is(err, os.ErrDeadlineExceeded) {
			break
		}
	}
	receiver.SetDeadline(time.Now().Add(10 * time.Second))
	publish(t, sender, "A", nil)
	receive(t, receiver)
	if receiver.Lost() == 0 || received+1+receiver.Lost() != 2_001 {
		t.Error(received, receiver.Lost())
	}
}

func TestCloseEndsReceive(t *testing.T) {
	receiver := receiverOf(t, Default, "")
	time.AfterFunc(20*time.Millisecond, func() { receiver.Close() })
	if _, err := receiver.Receive(); !errors.Is(err, net.ErrClosed) {
		t.Error(err)
	}
}

func TestChannelsThatCannotBeSent(t *testing.T) {
	sender := senderOf(t, Default, "")
	for _, channel := range []string{"", string(make([]byte, 3)), string(bytes.Repeat([]byte("x"), 64))} {
		if err := sender.Publish(channel, nil); err == nil {
			t.Errorf("%q is sent", channel)
		}
	}
	if err := sender.Publish("A", make([]byte, maxBytes+1)); err == nil {
		t.Error("a message beyond the limit is sent")
	}
}
