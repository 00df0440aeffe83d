#include "exemplar/bus/codec.hpp"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/exceptions/Exception.h>
#include <fastrtps/utils/md5.h>

#include <algorithm>
#include <exception>
#include <string>

#include "cdr_layout.hpp"
#include "exemplar/ircp/check.hpp"
#include "ircp_schemas.hpp"
#include "wire.hpp"

namespace exemplar::bus {
namespace {

using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

constexpr std::size_t kEncapsulationBytes = 4;

template <class Sample>
constexpr bool kHasSecondKey = requires(const Sample& s) {
  Wire<Sample>::SecondKey(s);
};

/// "exemplar::ircp::v1::Suit", made once for each type.
template <class Sample>
const std::string& TypeName() {
  static const std::string name = std::string("exemplar::ircp::v1::") + Wire<Sample>::kType;
  return name;
}

void AppendKeyString(std::vector<std::uint8_t>& key, const std::string& text) {
  while (key.size() % 4 != 0) key.push_back(0);
  const auto length = static_cast<std::uint32_t>(text.size() + 1);
  for (int shift = 24; shift >= 0; shift -= 8) {
    key.push_back(static_cast<std::uint8_t>(length >> shift));
  }
  key.insert(key.end(), text.begin(), text.end());
  key.push_back(0);
}

}  // namespace

template <class Sample>
std::vector<std::uint8_t> Encode(const Sample& sample) {
  typename Wire<Sample>::Message message;
  message.source(sample.header.source);
  message.seq(sample.header.seq);
  message.stamp_ns(sample.header.stamp.nanoseconds());
  Wire<Sample>::Fill(sample, message);

  std::vector<std::uint8_t> bytes(kEncapsulationBytes +
                                  Wire<Sample>::Message::getCdrSerializedSize(message));
  FastBuffer buffer(reinterpret_cast<char*>(bytes.data()), bytes.size());
  Cdr cdr(buffer, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
  cdr.serialize_encapsulation();
  message.serialize(cdr);
  // Strings end at their first NUL byte on the wire, so less than the size may be used.
  bytes.resize(cdr.getSerializedDataLength());
  return bytes;
}

template <class Sample>
Result<Sample> Decode(std::span<const std::uint8_t> bytes) {
  if (Status layout = CheckCdrLayout(bytes, Wire<Sample>::kLayout); !layout.ok()) {
    return WithPlace(layout.error(), TypeName<Sample>());
  }
  typename Wire<Sample>::Message message;
  try {
    // Fast CDR only reads here, though its buffer takes no const.
    FastBuffer buffer(reinterpret_cast<char*>(const_cast<std::uint8_t*>(bytes.data())),
                      bytes.size());
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.read_encapsulation();
    message.deserialize(cdr);
  } catch (const eprosima::fastcdr::exception::Exception& e) {
    return Error{ErrorCode::kDataLoss, TypeName<Sample>() + ": " + e.what()};
  }
  Sample sample;
  sample.header.source = std::move(message.source());
  sample.header.seq = message.seq();
  sample.header.stamp = Stamp::FromNanoseconds(message.stamp_ns());
  Wire<Sample>::Fill(message, sample);
  if (Status check = ircp::Check(sample); !check.ok()) {
    return WithPlace(check.error(), TypeName<Sample>());
  }
  return sample;
}

template <class Sample>
std::string_view SchemaOf() {
  return idl::FlattenedIdl(Wire<Sample>::kIdl);
}

template <class Sample>
std::string_view TypeNameOf() {
  return TypeName<Sample>();
}

template <class Sample>
std::array<std::uint8_t, 16> KeyHashOf(const Sample& sample) {
  // Big-endian CDR of the key fields; strings have no bound, so always their MD5 (RTPS 9.6.3.8).
  std::vector<std::uint8_t> key;
  AppendKeyString(key, sample.header.source);
  if constexpr (kHasSecondKey<Sample>) AppendKeyString(key, Wire<Sample>::SecondKey(sample));
  MD5 md5;
  md5.init();
  md5.update(key.data(), static_cast<unsigned>(key.size()));
  md5.finalize();
  std::array<std::uint8_t, 16> hash{};
  std::copy(std::begin(md5.digest), std::end(md5.digest), hash.begin());
  return hash;
}

#define EXEMPLAR_BUS_CODEC(Sample)                                     \
  template std::vector<std::uint8_t> Encode(const ircp::Sample&);      \
  template Result<ircp::Sample> Decode(std::span<const std::uint8_t>); \
  template std::string_view SchemaOf<ircp::Sample>();                  \
  template std::string_view TypeNameOf<ircp::Sample>();                \
  template std::array<std::uint8_t, 16> KeyHashOf(const ircp::Sample&);
EXEMPLAR_BUS_CODEC(SuitSample)
EXEMPLAR_BUS_CODEC(EndEffectorSample)
EXEMPLAR_BUS_CODEC(TactileSample)
EXEMPLAR_BUS_CODEC(CameraSample)
EXEMPLAR_BUS_CODEC(ObjectSample)
EXEMPLAR_BUS_CODEC(JointStateSample)
EXEMPLAR_BUS_CODEC(JointCommandSample)
EXEMPLAR_BUS_CODEC(PlanSample)
EXEMPLAR_BUS_CODEC(CommandSample)
EXEMPLAR_BUS_CODEC(StatusSample)
EXEMPLAR_BUS_CODEC(SafetySample)
EXEMPLAR_BUS_CODEC(ClockSample)
#undef EXEMPLAR_BUS_CODEC

}  // namespace exemplar::bus
