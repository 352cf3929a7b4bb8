// Gives datagrams to an Assembler, and prints what it makes of them.
//
// A frame of standard input is a datagram behind its time (8 bytes, us) and the port of its sender (2 bytes). A line for each message:
// channel and data in hexadecimal. The last line: received, malformed, lost and repeated.
package main

import (
	"bufio"
	"encoding/binary"
	"errors"
	"fmt"
	"io"
	"log"
	"net/netip"
	"os"
	"time"

	"axlecast/lcm"
	"consumers"
)

func main() {
	source, target := bufio.NewReader(os.Stdin), bufio.NewWriter(os.Stdout)
	assembler := lcm.NewAssembler()
	for {
		frame, err := consumers.ReadFrame(source)
		if errors.Is(err, io.EOF) {
			break
		}
		if err != nil {
			log.Fatal(err)
		}
		at := time.UnixMicro(int64(binary.BigEndian.Uint64(frame)))
		sender := netip.AddrPortFrom(netip.AddrFrom4([4]byte{10, 0, 0, 1}), binary.BigEndian.Uint16(frame[8:]))
		if message, complete := assembler.Add(frame[10:], sender, at); complete {
			fmt.Fprintf(target, "%x %x\n", message.Channel, message.Data)
		}
	}
	fmt.Fprintln(target, assembler.Received(), assembler.Malformed(), assembler.Lost(), assembler.Repeated())
	if err := target.Flush(); err != nil {
		log.Fatal(err)
	}
}
