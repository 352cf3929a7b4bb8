package lcm

import (
	"errors"
	"fmt"
	"net"
	"os"
	"syscall"
)

const (
	defaultBuffer    = 32 << 20 // bytes
	receiveBufForced = 33       // SO_RCVBUFFORCE
)

// listen returns a socket that receives the group, on the interface of that index.
//
// net.ListenMulticastUDP would bind the port alone, so that the messages of all groups of the port would arrive.
func listen(where URL, index int) (*net.UDPConn, error) {
	return open(where, func(socket int) error {
		if err := syscall.SetsockoptInt(socket, syscall.SOL_SOCKET, syscall.SO_REUSEADDR, 1); err != nil {
			return err
		}
		if err := enlargeBuffer(socket, where.ReceiveBuffer); err != nil {
			return err
		}
		if where.Group.Is4() {
			group := where.Group.As4()
			if err := syscall.Bind(socket, &syscall.SockaddrInet4{Port: int(where.Port), Addr: group}); err != nil {
				return err
			}
			return syscall.SetsockoptIPMreqn(socket, syscall.IPPROTO_IP, syscall.IP_ADD_MEMBERSHIP,
				&syscall.IPMreqn{Multiaddr: group, Ifindex: int32(index)})
		}
		group := where.Group.As16()
		if err := syscall.Bind(socket, &syscall.SockaddrInet6{Port: int(where.Port), Addr: group, ZoneId: uint32(index)}); err != nil {
			return err
		}
		return syscall.SetsockoptIPv6Mreq(socket, syscall.IPPROTO_IPV6, syscall.IPV6_JOIN_GROUP,
			&syscall.IPv6Mreq{Multiaddr: group, Interface: uint32(index)})
	})
}

// enlargeBuffer requests the receive buffer, with CAP_NET_ADMIN beyond net.core.rmem_max. Size 0: the default.
func enlargeBuffer(socket, size int) error {
	if size == 0 {
		size = defaultBuffer
	}
	err := syscall.SetsockoptInt(socket, syscall.SOL_SOCKET, receiveBufForced, size)
	if errors.Is(err, syscall.EPERM) {
		return syscall.SetsockoptInt(socket, syscall.SOL_SOCKET, syscall.SO_RCVBUF, size)
	}
	return err
}

// dial returns a socket that sends by the interface of that index, with the ttl of the URL.
func dial(where URL, index int) (*net.UDPConn, error) {
	return open(where, func(socket int) error {
		if where.Group.Is4() {
			if err := syscall.SetsockoptInt(socket, syscall.IPPROTO_IP, syscall.IP_MULTICAST_TTL, where.TTL); err != nil || index == 0 {
				return err
			}
			return syscall.SetsockoptIPMreqn(socket, syscall.IPPROTO_IP, syscall.IP_MULTICAST_IF, &syscall.IPMreqn{Ifindex: int32(index)})
		}
		if err := syscall.SetsockoptInt(socket, syscall.IPPROTO_IPV6, syscall.IPV6_MULTICAST_HOPS, where.TTL); err != nil || index == 0 {
			return err
		}
		return syscall.SetsockoptInt(socket, syscall.IPPROTO_IPV6, syscall.IPV6_MULTICAST_IF, index)
	})
}

// open returns a socket for the group's version of IP after setUp.
func open(where URL, setUp func(socket int) error) (*net.UDPConn, error) {
	family := syscall.AF_INET
	if !where.Group.Is4() {
		family = syscall.AF_INET6
	}
	socket, err := syscall.Socket(family, syscall.SOCK_DGRAM|syscall.SOCK_CLOEXEC|syscall.SOCK_NONBLOCK, 0)
	if err != nil {
		return nil, fmt.Errorf("socket: %w", err)
	}
	file := os.NewFile(uintptr(socket), "udpm")
	defer file.Close()
	if err := setUp(socket); err != nil {
		return nil, fmt.Errorf("group %s: %w", where.Group, err)
	}
	connection, err := net.FilePacketConn(file) // a copy
	if err != nil {
		return nil, err
	}
	return connection.(*net.UDPConn), nil
}
