package coding

import (
	"encoding/binary"
	"errors"
	"fmt"
	"math"
)

// Reader reads the fields of a message. After the first error, every value is 0 and every array is empty.
type Reader struct {
	data     []byte
	position int
	depth    int
	err      error
}

var (
	errShort  = errors.New("the message ends too early")
	errString = errors.New("a string has no end")
	errDeep   = errors.New("messages within messages are too deep")
)

func (r *Reader) left() int {
	return len(r.data) - r.position
}

func (r *Reader) fail(err error) {
	if r.err == nil {
		r.err = err
	}
}

// take returns the next bytes, and nil after an error.
func (r *Reader) take(size int) []byte {
	if r.err != nil {
		return nil
	}
	if size > r.left() {
		r.fail(errShort)
		return nil
	}
	taken := r.data[r.position : r.position+size]
	r.position += size
	return taken
}

// Int8 reads an int8_t.
func (r *Reader) Int8() int8 {
	return int8(r.Byte())
}

// Int16 reads an int16_t.
func (r *Reader) Int16() int16 {
	if taken := r.take(2); taken != nil {
		return int16(binary.BigEndian.Uint16(taken))
	}
	return 0
}

// Int32 reads an int32_t.
func (r *Reader) Int32() int32 {
	return int32(r.uint32())
}

// Int64 reads an int64_t.
func (r *Reader) Int64() int64 {
	return int64(r.uint64())
}

// Byte reads a byte.
func (r *Reader) Byte() byte {
	if taken := r.take(1); taken != nil {
		return taken[0]
	}
	return 0
}

// Bool reads a boolean. Every number except 0 is true.
func (r *Reader) Bool() bool {
	return r.Byte() != 0
}

// Float32 reads a float.
func (r *Reader) Float32() float32 {
	return math.Float32frombits(r.uint32())
}

// Float64 reads a double.
func (r *Reader) Float64() float64 {
	return math.Float64frombits(r.uint64())
}

// String reads a string: its length with the NUL at its end, its bytes, and the NUL.
func (r *Reader) String() string {
	size := r.uint32()
	if r.err != nil {
		return ""
	}
	if int64(size) > int64(r.left()) {
		r.fail(errShort)
		return ""
	}
	taken := r.take(int(size))
	if size == 0 || taken[size-1] != 0 {
		r.fail(errString)
		return ""
	}
	return string(taken[:size-1])
}

// Count returns the length of an array whose elements take at least elementSize bytes each, and 0 if the message cannot hold so
// many. Elements that may take no bytes are arrays without elements: there are at most as many as the message has bytes.
func (r *Reader) Count(count int64, elementSize int) int {
	if r.err != nil {
		return 0
	}
	most := int64(len(r.data))
	if elementSize > 0 {
		most = int64(r.left() / elementSize)
	}
	if count < 0 || count > most {
		r.fail(fmt.Errorf("an array has %d elements, and the message holds at most %d", count, most))
		return 0
	}
	return int(count)
}

// Struct reads a message within the message.
func (r *Reader) Struct(m Message) {
	if r.err != nil {
		return
	}
	if r.depth == maxDepth {
		r.fail(errDeep)
		return
	}
	r.depth++
	m.DecodeBody(r)
	r.depth--
}

func (r *Reader) uint32() uint32 {
	if taken := r.take(4); taken != nil {
		return binary.BigEndian.Uint32(taken)
	}
	return 0
}

func (r *Reader) uint64() uint64 {
	if taken := r.take(8); taken != nil {
		return binary.BigEndian.Uint64(taken)
	}
	return 0
}
