package lcm

import (
	"net/netip"
	"strings"
	"testing"
)

func TestParseURL(t *testing.T) {
	for text, expected := range map[string]URL{
		Default:                             {Group: netip.MustParseAddr("239.255.76.67"), Port: 7667},
		"udpm://224.0.0.1:1?ttl=255":        {Group: netip.MustParseAddr("224.0.0.1"), Port: 1, TTL: 255},
		"udpm://[ff15::6c63:6d]:7667?ttl=1": {Group: netip.MustParseAddr("ff15::6c63:6d"), Port: 7667, TTL: 1},
		"udpm://239.255.76.67:65535?recv_buf_size=4096&interface=192.168.5.0/24": {Group: netip.MustParseAddr("239.255.76.67"), Port: 65_535,
			ReceiveBuffer: 4096, Interface: "192.168.5.0/24"},
	} {
		parsed, err := ParseURL(text)
		if err != nil || parsed != expected {
			t.Errorf("%s: %+v, %v", text, parsed, err)
		}
	}
}

func TestWhatIsNoURL(t *testing.T) {
	for text, cause := range map[string]string{
		"":                                            "only udpm://",
		"tcpq://host:1":                               "only udpm://",
		"239.255.76.67:7667":                          "only udpm://",
		"udpm://10.0.0.1:7667":                        "no multicast group",
		"udpm://:7667":                                "no multicast group",
		"udpm://[fe80::1]:7667":                       "no multicast group",
		"udpm://239.255.76.67":                        "port must be",
		"udpm://239.255.76.67:0":                      "port must be",
		"udpm://239.255.76.67:65536":                  "port must be",
		"udpm://239.255.76.67:7667?ttl=256":           "ttl must be",
		"udpm://239.255.76.67:7667?ttl=-1":            "ttl must be",
		"udpm://239.255.76.67:7667?recv_buf_size=2GB": "recv_buf_size must be",
		"udpm://239.255.76.67:7667?a;b":               "semicolon",
	} {
		if _, err := ParseURL(text); err == nil || !strings.Contains(err.Error(), cause) {
			t.Errorf("%s: %v", text, err)
		}
	}
}
