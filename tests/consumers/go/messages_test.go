package consumers

import (
	"bytes"
	"errors"
	"io"
	"os"
	"strings"
	"testing"

	"axlecast"
	"axlecast/coding"
	"consumers/probe"
)

// Messages that lcm-gen's Python types encoded: frames of the file $AXLECAST_MESSAGES, one or more of each type.
func samples(t testing.TB) [][]byte {
	file, err := os.Open(os.Getenv("AXLECAST_MESSAGES"))
	if err != nil {
		t.Fatal(err)
	}
	defer file.Close()
	var found [][]byte
	for {
		frame, err := ReadFrame(file)
		if errors.Is(err, io.EOF) {
			return found
		}
		if err != nil {
			t.Fatal(err)
		}
		found = append(found, frame)
	}
}

func decode(data []byte) (coding.Message, error) {
	message, err := axlecast.Decode(data)
	if errors.Is(err, coding.ErrUnknownType) {
		return probe.Decode(data)
	}
	return message, err
}

func TestMessagesOfEveryType(t *testing.T) {
	types := map[string]bool{}
	for _, sample := range samples(t) {
		message, err := decode(sample)
		if err != nil {
			t.Fatal(err)
		}
		types[message.TypeName()] = true
		encoded, err := coding.Encode(message)
		if err != nil || !bytes.Equal(encoded, sample) {
			t.Errorf("%s: %x is encoded as %x, %v", message.TypeName(), sample, encoded, err)
		}
	}
	if len(types) < 31 {
		t.Errorf("only %d types: %v", len(types), types)
	}
}

func TestEveryCutMessageIsAnError(t *testing.T) {
	for _, sample := range samples(t) {
		for size := range sample {
			if _, err := decode(sample[:size]); err == nil {
				t.Fatalf("%x: the first %d bytes of %d are a message", sample, size, len(sample))
			}
		}
	}
}

func TestBytesBehindAMessageAreIgnored(t *testing.T) {
	for _, sample := range samples(t) {
		if _, err := decode(append(append([]byte{}, sample...), 1, 2, 3)); err != nil {
			t.Error(err)
		}
	}
}

func TestOtherTypesAreErrors(t *testing.T) {
	data, err := (&axlecast.Position{}).Encode()
	if err != nil {
		t.Fatal(err)
	}
	if err := (&axlecast.Alarm{}).Decode(data); err == nil {
		t.Error("a position is an alarm")
	}
	if _, err := axlecast.Decode(make([]byte, 100)); !errors.Is(err, coding.ErrUnknownType) {
		t.Error(err)
	}
}

func TestAStatedLengthThatIsWrong(t *testing.T) {
	alarm := axlecast.Alarm{N: 2, Entries: make([]axlecast.AlarmEntry, 1)}
	if _, err := alarm.Encode(); err == nil {
		t.Error("2 entries are stated, 1 is there")
	}
	alarm.N = 1
	if _, err := alarm.Encode(); err != nil {
		t.Error(err)
	}
}

func TestHugeAndNegativeLengthsTakeNoMemory(t *testing.T) {
	wire, err := (&axlecast.Wire{N: 0}).Encode()
	if err != nil {
		t.Fatal(err)
	}
	place := len(wire) - 16 - 2 // of n, before spare
	for _, count := range [][2]byte{{0x7f, 0xff}, {0xff, 0xff}, {0x80, 0}, {0, 2}} {
		copy(wire[place:], count[:])
		allocated := testing.Benchmark(func(b *testing.B) {
			b.ReportAllocs()
			for i := 0; i < b.N; i++ {
				if _, err := decode(wire); err == nil {
					b.Fatal("accepted")
				}
			}
		}).AllocedBytesPerOp()
		if allocated > 4096 {
			t.Errorf("%v: %d bytes", count, allocated)
		}
	}
}

func TestATreeThatIsTooDeep(t *testing.T) {
	tree := probe.Tree{}
	for level := 0; level < 63; level++ { // the leaf of the innermost tree is level 64
		tree = probe.Tree{N: 1, Children: []probe.Tree{tree}, Words: make([][2]string, 1), Marks: make([][]bool, 1)}
		tree.Marks[0] = []bool{}
	}
	data, err := tree.Encode()
	if err != nil {
		t.Fatal(err)
	}
	if err := new(probe.Tree).Decode(data); err != nil {
		t.Error(err)
	}
	tree = probe.Tree{N: 1, Children: []probe.Tree{tree}, Words: make([][2]string, 1), Marks: make([][]bool, 1)}
	if _, err := tree.Encode(); err == nil {
		t.Error("65 levels are encoded")
	}
}

func TestATreeWithoutEnd(t *testing.T) {
	data, err := new(probe.Tree).Encode()
	if err != nil {
		t.Fatal(err)
	}
	leaf, err := new(probe.Leaf).Encode()
	if err != nil {
		t.Fatal(err)
	}
	level := append([]byte{1, 0, 0}, leaf[8:]...)
	_, err = decode(append(data[:8:8], bytes.Repeat(level, 1<<18)...))
	if err == nil || !strings.Contains(err.Error(), "too deep") {
		t.Error(err)
	}
}

// FuzzDecode checks that no input makes Decode panic, and that what it accepts is encoded to the same bytes.
func FuzzDecode(f *testing.F) {
	for _, sample := range samples(f) {
		f.Add(sample)
	}
	f.Fuzz(func(t *testing.T, data []byte) {
		message, err := decode(data)
		if err != nil {
			return
		}
		encoded, err := coding.Encode(message)
		if err != nil {
			t.Fatal(err)
		}
		if message.TypeName() != "leaf_t" && message.TypeName() != "tree_t" && !bytes.HasPrefix(data, encoded) {
			t.Fatalf("%x is decoded as %x", data, encoded) // a boolean may be any number except 0
		}
	})
}
