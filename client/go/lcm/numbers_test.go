package lcm

import (
	"math"
	"testing"
	"time"
)

func counts(received ...uint32) [2]int64 {
	var counted numbers
	at := time.UnixMicro(0)
	for _, number := range received {
		at = at.Add(time.Millisecond)
		counted.receive(number, at)
	}
	return [2]int64{counted.lost, counted.repeated}
}

func TestNumbers(t *testing.T) {
	for _, row := range []struct {
		name     string
		received []uint32
		expected [2]int64
	}{
		{"no gap", []uint32{5, 6, 7}, [2]int64{0, 0}},
		{"a gap", []uint32{5, 8}, [2]int64{2, 0}},
		{"a late message", []uint32{5, 8, 6}, [2]int64{1, 0}},
		{"a repeated message", []uint32{5, 8, 6, 7, 7}, [2]int64{0, 1}},
		{"wrap-around", []uint32{math.MaxUint32 - 1, math.MaxUint32, 0, 1}, [2]int64{0, 0}},
		{"a gap at the wrap-around", []uint32{math.MaxUint32 - 1, 1}, [2]int64{2, 0}},
		{"late messages at the wrap-around", []uint32{math.MaxUint32 - 1, 1, math.MaxUint32, 0}, [2]int64{0, 0}},
		{"messages before the begin", []uint32{100, 99, 60, 101}, [2]int64{0, 0}},
		{"a restart, further back than a late message", []uint32{10_000, 10_001, 0, 1}, [2]int64{0, 0}},
		{"a jump that no loss explains", []uint32{1, 2 + 1<<24}, [2]int64{0, 0}},
		{"a large gap", []uint32{0, 100_001}, [2]int64{100_000, 0}},
		{"late messages of a large gap", []uint32{0, 100_001, 100_000, 100_001 - 4_095}, [2]int64{99_998, 0}},
	} {
		if counted := counts(row.received...); counted != row.expected {
			t.Errorf("%s: %v, expected %v", row.name, counted, row.expected)
		}
	}
}

func TestZeroAfterASilenceIsARestart(t *testing.T) {
	for gap, expected := range map[time.Duration]int64{49 * time.Millisecond: 1, 50 * time.Millisecond: 0} {
		var counted numbers
		at := time.UnixMicro(0)
		for number := uint32(0); number < 3; number++ {
			counted.receive(number, at)
		}
		counted.receive(0, at.Add(gap))
		if counted.lost != 0 || counted.repeated != expected {
			t.Errorf("%v: %d lost, %d repeated", gap, counted.lost, counted.repeated)
		}
	}
}
