// Package coding encodes and decodes LCM messages. The types that lcmtypes/go/generate.py writes use it.
//
// Every input that is not a message gives an error. A message never takes more memory than a fixed multiple of its bytes.
package coding

import (
	"encoding/binary"
	"errors"
	"fmt"
)

// Message is a message of a generated type.
type Message interface {
	// TypeName returns the name of the type in its .lcm file.
	TypeName() string

	// Fingerprint returns the number with which each message of the type begins.
	Fingerprint() uint64

	// DecodeBody reads the fields.
	DecodeBody(r *Reader)

	// EncodeBody writes the fields.
	EncodeBody(w *Writer)
}

// ErrUnknownType is the error of a message whose fingerprint no type has.
var ErrUnknownType = errors.New("no type has the fingerprint of the message")

const fingerprintSize = 8

// The deepest nesting of messages within messages.
const maxDepth = 64

// Decode reads a message as it was received into m. Bytes behind the message are ignored.
func Decode(data []byte, m Message) error {
	if len(data) < fingerprintSize || binary.BigEndian.Uint64(data) != m.Fingerprint() {
		return fmt.Errorf("the message is no %s", m.TypeName())
	}
	r := Reader{data: data, position: fingerprintSize}
	m.DecodeBody(&r)
	if r.err != nil {
		return fmt.Errorf("%s: %w", m.TypeName(), r.err)
	}
	return nil
}

// DecodeAny reads a message of any type that create knows: it returns an empty message for a fingerprint, and nil for others.
func DecodeAny(data []byte, create func(fingerprint uint64) Message) (Message, error) {
	if len(data) < fingerprintSize {
		return nil, ErrUnknownType
	}
	m := create(binary.BigEndian.Uint64(data))
	if m == nil {
		return nil, ErrUnknownType
	}
	if err := Decode(data, m); err != nil {
		return nil, err
	}
	return m, nil
}

// Encode returns m as it is sent.
func Encode(m Message) ([]byte, error) {
	w := Writer{data: binary.BigEndian.AppendUint64(nil, m.Fingerprint())}
	m.EncodeBody(&w)
	if w.err != nil {
		return nil, fmt.Errorf("%s: %w", m.TypeName(), w.err)
	}
	return w.data, nil
}
