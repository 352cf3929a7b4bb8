package lcm

import (
	"fmt"
	"net"
	"net/netip"
)

// interfaceIndex returns the index of an interface by its name, one of its addresses, or a network in which it has one; 0 for "".
func interfaceIndex(text string) (int, error) {
	if text == "" {
		return 0, nil
	}
	network, err := netip.ParsePrefix(text)
	if address, single := netip.ParseAddr(text); single == nil {
		network, err = netip.PrefixFrom(address, address.BitLen()), nil
	}
	if err != nil {
		named, err := net.InterfaceByName(text)
		if err != nil {
			return 0, fmt.Errorf("interface %s: %w", text, err)
		}
		return named.Index, nil
	}
	interfaces, err := net.Interfaces()
	if err != nil {
		return 0, err
	}
	for _, candidate := range interfaces {
		if hasAddressIn(candidate, network) {
			return candidate.Index, nil
		}
	}
	return 0, fmt.Errorf("this host has no interface with an address in %s", text)
}

func hasAddressIn(candidate net.Interface, network netip.Prefix) bool {
	addresses, err := candidate.Addrs()
	if err != nil {
		return false
	}
	for _, address := range addresses {
		own, err := netip.ParsePrefix(address.String())
		if err == nil && network.Contains(own.Addr().WithZone("")) {
			return true
		}
	}
	return false
}
