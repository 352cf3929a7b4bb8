package coding

import (
	"encoding/binary"
	"fmt"
	"math"
)

// Writer writes the fields of a message.
type Writer struct {
	data  []byte
	depth int
	err   error
}

// Int8 writes an int8_t.
func (w *Writer) Int8(value int8) {
	w.data = append(w.data, byte(value))
}

// Int16 writes an int16_t.
func (w *Writer) Int16(value int16) {
	w.data = binary.BigEndian.AppendUint16(w.data, uint16(value))
}

// Int32 writes an int32_t.
func (w *Writer) Int32(value int32) {
	w.data = binary.BigEndian.AppendUint32(w.data, uint32(value))
}

// Int64 writes an int64_t.
func (w *Writer) Int64(value int64) {
	w.data = binary.BigEndian.AppendUint64(w.data, uint64(value))
}

// Byte writes a byte.
func (w *Writer) Byte(value byte) {
	w.data = append(w.data, value)
}

// Bool writes a boolean.
func (w *Writer) Bool(value bool) {
	if value {
		w.Byte(1)
	} else {
		w.Byte(0)
	}
}

// Float32 writes a float.
func (w *Writer) Float32(value float32) {
	w.data = binary.BigEndian.AppendUint32(w.data, math.Float32bits(value))
}

// Float64 writes a double.
func (w *Writer) Float64(value float64) {
	w.data = binary.BigEndian.AppendUint64(w.data, math.Float64bits(value))
}

// String writes a string.
func (w *Writer) String(value string) {
	if int64(len(value)) >= math.MaxInt32 {
		w.fail(fmt.Errorf("a string has %d bytes", len(value)))
		return
	}
	w.Int32(int32(len(value) + 1))
	w.data = append(w.data, value...)
	w.Byte(0)
}

// Length checks that an array has the length that its member states.
func (w *Writer) Length(name string, length int, stated int64) {
	if int64(length) != stated {
		w.fail(fmt.Errorf("%s has %d elements, and its member for the length is %d", name, length, stated))
	}
}

// Struct writes a message within the message.
func (w *Writer) Struct(m Message) {
	if w.err != nil {
		return
	}
	if w.depth == maxDepth {
		w.fail(errDeep)
		return
	}
	w.depth++
	m.EncodeBody(w)
	w.depth--
}

func (w *Writer) fail(err error) {
	if w.err == nil {
		w.err = err
	}
}
