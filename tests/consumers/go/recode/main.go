// Decodes the message of each frame of standard input, encodes it again, and writes it as a frame; an empty frame if it is damaged.
package main

import (
	"bufio"
	"errors"
	"io"
	"log"
	"os"

	"axlecast"
	"axlecast/coding"
	"consumers"
	"consumers/probe"
)

func main() {
	source, target := bufio.NewReader(os.Stdin), bufio.NewWriter(os.Stdout)
	for {
		frame, err := consumers.ReadFrame(source)
		if errors.Is(err, io.EOF) {
			break
		}
		if err != nil {
			log.Fatal(err)
		}
		if err := consumers.WriteFrame(target, recode(frame)); err != nil {
			log.Fatal(err)
		}
	}
	if err := target.Flush(); err != nil {
		log.Fatal(err)
	}
}

func recode(data []byte) []byte {
	message, err := axlecast.Decode(data)
	if errors.Is(err, coding.ErrUnknownType) {
		message, err = probe.Decode(data)
	}
	if err != nil {
		return nil
	}
	encoded, err := coding.Encode(message)
	if err != nil {
		log.Fatalf("what was decoded cannot be encoded: %v", err)
	}
	return encoded
}
