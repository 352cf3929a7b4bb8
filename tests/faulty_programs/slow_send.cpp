// For LD_PRELOAD: a busy machine, on which a program waits 300 ms for the processor before each sendto.

#include <dlfcn.h>
#include <sys/socket.h>
#include <time.h>

extern "C" ssize_t sendto(int socket, const void* data, size_t size, int flags, const sockaddr* address,
                          socklen_t address_size) {
  const timespec wait{.tv_sec = 0, .tv_nsec = 300'000'000};
  nanosleep(&wait, nullptr);
  using SendTo = decltype(::sendto);
  return reinterpret_cast<SendTo*>(dlsym(RTLD_NEXT, "sendto"))(socket, data, size, flags, address, address_size);
}
