// Prints the positions of one machine's axes: print_position [URL [PREFIX]]
package main

import (
	"fmt"
	"os"

	"axlecast"
	"axlecast/lcm"
)

func main() {
	if err := run(argument(1, lcm.Default), argument(2, "")); err != nil {
		fmt.Fprintln(os.Stderr, err)
		os.Exit(1)
	}
}

func run(url, prefix string) error {
	receiver, err := lcm.NewReceiver(url, prefix)
	if err != nil {
		return err
	}
	defer receiver.Close()
	for {
		message, err := receiver.Receive()
		if err != nil {
			return err
		}
		decoded, err := axlecast.Decode(message.Data)
		if position, ok := decoded.(*axlecast.Position); ok && err == nil {
			fmt.Printf("%s %s %d lost\n", message.Channel, text(position), receiver.Lost())
		}
	}
}

func text(position *axlecast.Position) string {
	if position.Flags&axlecast.PositionFlagValid == 0 {
		return "not valid"
	}
	return fmt.Sprintf("%.3f", position.Value)
}

func argument(index int, otherwise string) string {
	if index < len(os.Args) {
		return os.Args[index]
	}
	return otherwise
}
