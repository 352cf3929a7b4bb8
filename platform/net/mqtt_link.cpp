#include "platform/net/mqtt_link.h"

#include <fcntl.h>
#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <netdb.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "platform/os/descriptor.h"

namespace axlecast {
namespace {

constexpr int kWillQos = 1;
constexpr int kSubscriptionQos = 1;

struct Destroy {
  void operator()(mosquitto* client) const { mosquitto_destroy(client); }
};

// Returns why a broker refused the connection, with the remedy if it is known.
std::string RefusalText(int code, bool version_5) {
  if (version_5 && code == MQTT_RC_UNSUPPORTED_PROTOCOL_VERSION) {
    return "the broker does not support MQTT 5: set protocol: 3.1.1";
  }
  const std::string reason = version_5 ? mosquitto_reason_string(code) : mosquitto_connack_string(code);
  const bool credentials =
      version_5 ? code == MQTT_RC_BAD_USERNAME_OR_PASSWORD || code == MQTT_RC_NOT_AUTHORIZED
                : code == CONNACK_REFUSED_BAD_USERNAME_PASSWORD || code == CONNACK_REFUSED_NOT_AUTHORIZED;
  return "the broker refuses the connection: " + reason + (credentials ? " (check user and password)" : "");
}

std::string DisconnectText(int code) {
  if (code == MQTT_RC_SESSION_TAKEN_OVER) {
    return "another client has taken the session over: give each bridge a client_id of its own";
  }
  return std::string("the broker ends the connection: ") + mosquitto_reason_string(code);
}

// Returns the families of the addresses of a host, in the order in which to try them; none if the host is unknown.
std::vector<int> FamiliesOf(const std::string& host) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(host.c_str(), nullptr, &hints, &found) != 0) return {};
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> addresses(found, freeaddrinfo);
  std::vector<int> families;
  for (const addrinfo* address = found; address != nullptr; address = address->ai_next) {
    if (std::find(families.begin(), families.end(), address->ai_family) == families.end()) {
      families.push_back(address->ai_family);
    }
  }
  return families;
}

// Returns why a socket hung up; no text while there may be something to read.
std::string HangUpText(int socket) {
  int error = 0;
  socklen_t size = sizeof error;
  if (getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size) == 0 && error != 0) return std::strerror(error);
  // OpenSSL has consumed the error of a connection that was refused at once, and libmosquitto does not report it.
  sockaddr_storage peer{};
  size = sizeof peer;
  const bool connected = getpeername(socket, reinterpret_cast<sockaddr*>(&peer), &size) == 0;
  return connected ? "" : std::strerror(ECONNREFUSED);
}

Result<> CheckFile(const std::string& file, bool secret) {
  if (file.empty()) return {};
  const Descriptor opened(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK));
  if (!opened.valid()) return Failure(file + ": " + std::strerror(errno));
  struct stat status {};
  if (fstat(opened.get(), &status) != 0) return Failure(file + ": " + std::strerror(errno));
  if (!S_ISREG(status.st_mode)) return Failure(file + " is no regular file: name a PEM file");
  if (secret && (status.st_mode & (S_IWGRP | S_IXGRP | S_IRWXO)) != 0) {
    return Failure(file + " is open to other users: chmod 600 '" + file + "'");
  }
  return {};
}

}  // namespace

// A client of libmosquitto, from Connect to its end.
struct MqttLink::Client {
  explicit Client(MqttLink& owner)
      : link(owner), handle(mosquitto_new(owner.settings_.client_id.c_str(), true, this)) {
    if (!handle) return;
    mosquitto_int_option(handle.get(), MOSQ_OPT_PROTOCOL_VERSION,
                         link.settings_.version_5 ? MQTT_PROTOCOL_V5 : MQTT_PROTOCOL_V311);
    mosquitto_int_option(handle.get(), MOSQ_OPT_TCP_NODELAY,
                         1);  // confirmations come back at once, and the next go
    mosquitto_connect_v5_callback_set(handle.get(),
                                      [](mosquitto*, void* self, int code, int, const mosquitto_property*) {
                                        static_cast<Client*>(self)->OnConnect(code);
                                      });
    mosquitto_publish_v5_callback_set(handle.get(),
                                      [](mosquitto*, void* self, int id, int code, const mosquitto_property*) {
                                        static_cast<Client*>(self)->OnPublish(id, code);
                                      });
    mosquitto_disconnect_v5_callback_set(
        handle.get(), [](mosquitto*, void* self, int code, const mosquitto_property*) {
          // Lower codes are of libmosquitto itself, and returned by the call that failed.
          if (code >= MQTT_RC_UNSPECIFIED)
            static_cast<Client*>(self)->link.Down(DisconnectText(code), false, code == MQTT_RC_SESSION_TAKEN_OVER);
        });
    mosquitto_subscribe_v5_callback_set(
        handle.get(), [](mosquitto*, void* self, int id, int count, const int* codes, const mosquitto_property*) {
          static_cast<Client*>(self)->OnSubscribe(id, count > 0 ? codes[0] : MQTT_RC_UNSPECIFIED);
        });
    mosquitto_message_v5_callback_set(
        handle.get(), [](mosquitto*, void* self, const mosquitto_message* message, const mosquitto_property*) {
          static_cast<Client*>(self)->OnMessage(*message);
        });
    mosquitto_log_callback_set(handle.get(), [](mosquitto*, void* self, int level, const char* text) {
      if (level == MOSQ_LOG_ERR) static_cast<Client*>(self)->error = text;
    });
  }

  void OnConnect(int code) {
    if (code == 0) {
      --link.settings_.attempts;
      link.events_.push_back({BrokerEvent::Kind::kConnected, 0, ""});
    } else {
      link.Down(RefusalText(code, link.settings_.version_5));
    }
  }

  void OnPublish(int id, int code) {
    const bool refused = code >= MQTT_RC_UNSPECIFIED;
    link.events_.push_back({refused ? BrokerEvent::Kind::kRefused : BrokerEvent::Kind::kTaken, id,
                            refused ? mosquitto_reason_string(code) : ""});
  }

  // In MQTT 3.1.1 and 5, codes from 128 are refusals; lower ones are the granted QoS.
  void OnSubscribe(int id, int code) {
    const bool refused = code >= MQTT_RC_UNSPECIFIED;
    link.events_.push_back({refused ? BrokerEvent::Kind::kRefused : BrokerEvent::Kind::kTaken, id,
                            refused ? mosquitto_reason_string(code) : ""});
  }

  void OnMessage(const mosquitto_message& message) {
    BrokerEvent event{.kind = BrokerEvent::Kind::kReceived, .topic = message.topic, .retained = message.retain};
    const auto size = static_cast<std::size_t>(std::max(message.payloadlen, 0));
    if (size > 0 && size <= kLongestReceived) event.text.assign(static_cast<const char*>(message.payload), size);
    link.events_.push_back(std::move(event));
  }

  MqttLink& link;
  std::unique_ptr<mosquitto, Destroy> handle;
  std::string error;  // the newest of libmosquitto, such as those of OpenSSL
};

MqttLink::MqttLink(MqttLinkSettings settings, SecretSource& secrets)
    : settings_(std::move(settings)), secrets_(secrets) {
  mosquitto_lib_init();
}

MqttLink::~MqttLink() {
  client_.reset();
  mosquitto_lib_cleanup();
}

void MqttLink::Connect(const BrokerMessage& will) {
  Drop();
  down_ = false;
  client_ = std::make_unique<Client>(*this);
  if (const Result<> prepared = Prepare(will); !prepared) return Down(prepared.error().text);
  Check(mosquitto_connect_bind_async(client_->handle.get(), settings_.host.c_str(), settings_.port,
                                     settings_.keep_alive_s, NextFamily()));
}

// libmosquitto tries only the first address of a name to which the bound address can connect. The bound address therefore
// selects the family.
const char* MqttLink::NextFamily() {
  const std::vector<int> families = FamiliesOf(settings_.host);
  const std::size_t attempt = settings_.attempts++;
  if (families.size() < 2) return nullptr;
  return families[attempt % families.size()] == AF_INET6 ? "::" : "0.0.0.0";
}

Result<> MqttLink::Prepare(const BrokerMessage& will) {
  mosquitto* const client = client_->handle.get();
  if (client == nullptr) return Failure(std::string("libmosquitto: ") + std::strerror(errno));
  const auto text = [](const std::string& word) { return word.empty() ? nullptr : word.c_str(); };
  int result = mosquitto_will_set(client, will.topic.c_str(), static_cast<int>(will.payload.size()),
                                  will.payload.data(), kWillQos, will.retain);
  if (result == MOSQ_ERR_SUCCESS && settings_.tls) {
    result = mosquitto_tls_set(client, text(settings_.ca), settings_.ca.empty() ? "/etc/ssl/certs" : nullptr,
                               text(settings_.certificate), text(settings_.key),
                               [](char*, int, int, void*) { return 0; });  // a passphrase is never asked for
  }
  Secret password;
  if (!settings_.password.empty()) {
    Result<Secret> read = secrets_.Read(settings_.password);
    if (!read) return Failure(read.error());
    password = std::move(*read);
  }
  if (result == MOSQ_ERR_SUCCESS && !settings_.user.empty()) {
    const std::string_view word = password.text();
    result = mosquitto_username_pw_set(client, settings_.user.c_str(), word.empty() ? nullptr : word.data());
  }
  if (result != MOSQ_ERR_SUCCESS) return Failure(std::string("libmosquitto: ") + mosquitto_strerror(result));
  return {};
}

void MqttLink::Drop() {
  client_.reset();
  events_.clear();
  down_ = true;
}

void MqttLink::Disconnect(bool publish_will) {
  // libmosquitto ignores the reason with MQTT 3.1.1, which has none.
  const int reason = publish_will ? MQTT_RC_DISCONNECT_WITH_WILL_MSG : MQTT_RC_NORMAL_DISCONNECTION;
  if (client_ && !down_) mosquitto_disconnect_v5(client_->handle.get(), reason, nullptr);
  Drop();
}

int MqttLink::Send(const BrokerMessage& message) {
  int id = 0;
  const int result =
      mosquitto_publish(client_->handle.get(), &id, message.topic.c_str(), static_cast<int>(message.payload.size()),
                        message.payload.data(), message.qos, message.retain);
  if (result == MOSQ_ERR_OVERSIZE_PACKET || result == MOSQ_ERR_RETAIN_NOT_SUPPORTED ||
      result == MOSQ_ERR_QOS_NOT_SUPPORTED || result == MOSQ_ERR_PAYLOAD_SIZE) {
    id = --refused_;  // libmosquitto has not numbered it
    events_.push_back({BrokerEvent::Kind::kRefused, id, mosquitto_strerror(result)});
  } else {
    Check(result);
  }
  return id;
}

int MqttLink::Subscribe(const std::string& filter) {
  int id = 0;
  Check(mosquitto_subscribe(client_->handle.get(), &id, filter.c_str(), kSubscriptionQos));
  return id;
}

std::vector<BrokerEvent> MqttLink::Poll() {
  if (client_ && !down_) Check(mosquitto_loop_misc(client_->handle.get()));
  if (pollfd waiting = Waiting(); waiting.fd >= 0 && poll(&waiting, 1, 0) > 0) {
    if ((waiting.revents & (POLLERR | POLLHUP)) != 0) {
      if (std::string text = HangUpText(waiting.fd); !text.empty()) Down(std::move(text));
    }
    if (!down_) Check(mosquitto_loop_read(client_->handle.get(), 1));
    if (!down_ && mosquitto_want_write(client_->handle.get()))
      Check(mosquitto_loop_write(client_->handle.get(), 1));
  }
  return std::exchange(events_, {});
}

pollfd MqttLink::Waiting() const {
  if (down_ || !client_) return {-1, 0, 0};
  const bool write = mosquitto_want_write(client_->handle.get());
  return {mosquitto_socket(client_->handle.get()), static_cast<short>(write ? POLLIN | POLLOUT : POLLIN), 0};
}

void MqttLink::Check(int result) {
  if (result == MOSQ_ERR_SUCCESS || result == MOSQ_ERR_CONN_PENDING) return;
  std::string text = result == MOSQ_ERR_ERRNO ? std::strerror(errno)
                     : result == MOSQ_ERR_EAI ? "the name cannot be resolved"
                                              : mosquitto_strerror(result);
  if (!client_->error.empty()) text += " (" + client_->error + ")";
  const bool fault = result == MOSQ_ERR_PROTOCOL || result == MOSQ_ERR_MALFORMED_PACKET ||
                     result == MOSQ_ERR_MALFORMED_UTF8 || result == MOSQ_ERR_NOMEM;
  Down(std::move(text), fault);
}

void MqttLink::Down(std::string text, bool fault, bool taken_over) {
  if (down_) return;
  down_ = true;
  events_.push_back(
      {.kind = BrokerEvent::Kind::kDown, .text = std::move(text), .fault = fault, .taken_over = taken_over});
}

Result<> CheckMqttCredentials(const MqttLinkSettings& settings, SecretSource& secrets) {
  for (const std::string* file : {&settings.ca, &settings.certificate}) {
    if (Result<> done = CheckFile(*file, false); !done) return done;
  }
  if (Result<> done = CheckFile(settings.key, true); !done) return done;
  if (settings.password.empty()) return {};
  const Result<Secret> password = secrets.Read(settings.password);
  if (!password) return Failure(password.error());
  return {};
}

}  // namespace axlecast
