/* Reads ircp/end_effector with Cyclone DDS, reliably, and counts by the samples' own numbers.
   usage: reader DOMAIN PARTITION LAST QUIET_S
   Prints a line when the first sample comes. Ends once the number LAST has come and nothing is missing below it, or
   after QUIET_S seconds without another sample. Prints: {"received": R, "first": F, "last": L, "gaps": [[G, H], ...]},
   where everything from G to H is missing. */
#include <dds/dds.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "end_effector.h"

enum { kMost = 100000, kBatch = 64 };

static void check(dds_return_t code, const char* what) {
  if (code >= 0) return;
  fprintf(stderr, "%s: %s\n", what, dds_strretcode(-code));
  exit(1);
}

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  const char* partition = argv[2];
  const unsigned long long wanted = strtoull(argv[3], NULL, 10);
  const dds_duration_t quiet = DDS_SECS(atoi(argv[4]));
  const dds_entity_t participant = dds_create_participant((dds_domainid_t)atoi(argv[1]), NULL, NULL);
  check(participant, "participant");
  dds_qos_t* qos = dds_create_qos();
  dds_qset_partition(qos, 1, &partition);
  const dds_entity_t subscriber = dds_create_subscriber(participant, qos, NULL);
  check(subscriber, "subscriber");
  const dds_entity_t topic =
      dds_create_topic(participant, &exemplar_ircp_v1_EndEffector_desc, "ircp/end_effector", NULL, NULL);
  check(topic, "topic");
  dds_reset_qos(qos);
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
  dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  const dds_entity_t reader = dds_create_reader(subscriber, topic, qos, NULL);
  check(reader, "reader");
  dds_delete_qos(qos);
  const dds_entity_t waitset = dds_create_waitset(participant);
  check(dds_waitset_attach(waitset, dds_create_readcondition(reader, DDS_ANY_STATE), 0), "waitset");

  static char seen[kMost];
  unsigned long long received = 0, first = 0, last = 0;
  while (last < wanted || received < last - first + 1) {
    if (dds_waitset_wait(waitset, NULL, 0, received == 0 ? DDS_SECS(60) : quiet) <= 0) break;
    void* samples[kBatch] = {0};
    dds_sample_info_t infos[kBatch];
    const int count = dds_take(reader, samples, infos, kBatch, kBatch);
    check(count, "take");
    for (int i = 0; i < count; ++i) {
      const exemplar_ircp_v1_EndEffector* sample = samples[i];
      if (!infos[i].valid_data || sample->seq >= kMost || seen[sample->seq]) continue;
      seen[sample->seq] = 1;
      if (received++ == 0) printf("first\n");
      if (first == 0 || sample->seq < first) first = sample->seq;
      if (sample->seq > last) last = sample->seq;
    }
    fflush(stdout);
    if (count > 0) check(dds_return_loan(reader, samples, count), "loan");
  }
  printf("{\"received\": %llu, \"first\": %llu, \"last\": %llu, \"gaps\": [", received, first, last);
  const char* comma = "";
  for (unsigned long long seq = first; seq < last; ++seq) {
    if (seen[seq]) continue;
    const unsigned long long begin = seq;
    while (!seen[seq + 1]) ++seq;
    printf("%s[%llu, %llu]", comma, begin, seq);
    comma = ", ";
  }
  printf("]}\n");
  dds_delete(participant);
  return 0;
}
