package lcm

import (
	"fmt"
	"net/netip"
	"net/url"
	"strconv"
	"strings"
)

// Default is the URL of a machine whose file has no `lcm: url`.
const Default = "udpm://239.255.76.67:7667?ttl=0"

// URL is where messages are sent and received: udpm://GROUP:PORT[?ttl=0..255][&recv_buf_size=BYTES][&interface=INTERFACE].
type URL struct {
	// Address of the multicast group, IPv4 or IPv6.
	Group netip.Addr

	Port uint16

	// 0: this host only.
	TTL int

	// Bytes; 0: 32 MB, as far as the kernel permits (net.core.rmem_max).
	ReceiveBuffer int

	// Name, address or network (192.168.5.0/24) of an interface; empty: the route of the kernel selects one.
	Interface string
}

// ParseURL returns the parts of a URL. The error states the cause.
func ParseURL(text string) (URL, error) {
	scheme, rest, found := strings.Cut(text, "://")
	if !found || scheme != "udpm" {
		return URL{}, fmt.Errorf("%s: only udpm:// can be received, for example %s", text, Default)
	}
	place, query, _ := strings.Cut(rest, "?")
	group, port := splitPlace(place)
	parsed := URL{}
	var err error
	if parsed.Group, err = netip.ParseAddr(group); err != nil || !parsed.Group.IsMulticast() || parsed.Group.Zone() != "" {
		return URL{}, fmt.Errorf("%s: '%s' is no multicast group: 224.0.0.0 to 239.255.255.255, or ff00::/8 in brackets", text, group)
	}
	options, err := url.ParseQuery(query)
	if err != nil {
		return URL{}, fmt.Errorf("%s: %w", text, err)
	}
	number, err := numberIn(text, "port", port, 1, 65_535)
	if err != nil {
		return URL{}, err
	}
	parsed.Port = uint16(number)
	if parsed.TTL, err = numberIn(text, "ttl", option(options, "ttl", "0"), 0, 255); err != nil {
		return URL{}, err
	}
	if parsed.ReceiveBuffer, err = numberIn(text, "recv_buf_size", option(options, "recv_buf_size", "0"), 0, 1<<30); err != nil {
		return URL{}, err
	}
	parsed.Interface = option(options, "interface", "")
	return parsed, nil
}

// splitPlace returns the group without brackets, and the port.
func splitPlace(place string) (group, port string) {
	if strings.HasPrefix(place, "[") {
		group, port, _ = strings.Cut(place[1:], "]")
		return group, strings.TrimPrefix(port, ":")
	}
	group, port, _ = strings.Cut(place, ":")
	return group, port
}

// option returns the last value of an option.
func option(options url.Values, name, otherwise string) string {
	if values := options[name]; len(values) > 0 {
		return values[len(values)-1]
	}
	return otherwise
}

func numberIn(text, name, value string, low, high int) (int, error) {
	number, err := strconv.ParseUint(value, 10, 31)
	if err != nil || int(number) < low || int(number) > high {
		return 0, fmt.Errorf("%s: %s must be %d to %d, and is '%s'", text, name, low, high, value)
	}
	return int(number), nil
}
