// Package consumers reads and writes the frames in which the tests exchange bytes: 4 bytes of length, big-endian, and the bytes.
package consumers

import (
	"encoding/binary"
	"io"
)

// ReadFrame returns the next frame; io.EOF after the last one.
func ReadFrame(source io.Reader) ([]byte, error) {
	var head [4]byte
	if _, err := io.ReadFull(source, head[:]); err != nil {
		return nil, err
	}
	frame := make([]byte, binary.BigEndian.Uint32(head[:]))
	if _, err := io.ReadFull(source, frame); err != nil {
		return nil, io.ErrUnexpectedEOF
	}
	return frame, nil
}

// WriteFrame writes a frame.
func WriteFrame(target io.Writer, frame []byte) error {
	head := binary.BigEndian.AppendUint32(nil, uint32(len(frame)))
	if _, err := target.Write(head); err != nil {
		return err
	}
	_, err := target.Write(frame)
	return err
}
