/* Once somebody reads and a line has come on its standard input, writes COUNT samples of one topic with Cyclone DDS,
   waits until they are acknowledged, and goes.
   usage: writer DOMAIN PARTITION|- TOPIC plain|keyed COUNT [SCHEMA_FILE] */
#include <dds/dds.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "reading.h"

static void check(dds_return_t code, const char* what) {
  if (code >= 0) return;
  fprintf(stderr, "%s: %s\n", what, dds_strretcode(-code));
  exit(1);
}

int main(int argc, char** argv) {
  if (argc < 6) return 2;
  const int keyed = strcmp(argv[4], "keyed") == 0;
  const int count = atoi(argv[5]);
  const char* partition = argv[2];
  const dds_entity_t participant = dds_create_participant((dds_domainid_t)atoi(argv[1]), NULL, NULL);
  check(participant, "participant");
  dds_qos_t* qos = dds_create_qos();
  if (strcmp(partition, "-") != 0) dds_qset_partition(qos, 1, &partition);
  const dds_entity_t publisher = dds_create_publisher(participant, qos, NULL);
  check(publisher, "publisher");
  const dds_topic_descriptor_t* type = keyed ? &lab_v1_KeyedReading_desc : &lab_v1_Reading_desc;
  const dds_entity_t topic = dds_create_topic(participant, type, argv[3], NULL, NULL);
  check(topic, "topic");
  dds_reset_qos(qos);
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
  dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  char* schema = NULL;
  if (argc > 6) {
    FILE* file = fopen(argv[6], "rb");
    if (file == NULL) return 2;
    schema = malloc(60000);
    dds_qset_userdata(qos, schema, fread(schema, 1, 60000, file));
    fclose(file);
  }
  const dds_entity_t writer = dds_create_writer(publisher, topic, qos, NULL);
  check(writer, "writer");
  dds_delete_qos(qos);
  free(schema);

  dds_publication_matched_status_t matched = {0};
  for (int i = 0; i < 6000 && matched.current_count == 0; ++i) {
    check(dds_get_publication_matched_status(writer, &matched), "matched");
    dds_sleepfor(DDS_MSECS(10));
  }
  if (matched.current_count == 0) {
    fprintf(stderr, "no reader\n");
    return 1;
  }
  if (getchar() == EOF) return 1;
  for (int i = 1; i <= count; ++i) {
    if (keyed) {
      char sensor[16];
      double values[3] = {i, 2.0 * i, 3.0 * i};
      snprintf(sensor, sizeof sensor, "sensor%d", i % 20);
      lab_v1_KeyedReading sample = {.sensor = sensor, .number = i};
      sample.values._maximum = sample.values._length = 3;
      sample.values._buffer = values;
      check(dds_write(writer, &sample), "write");
    } else {
      const lab_v1_Reading sample = {.number = i, .value = 0.5 * i};
      check(dds_write(writer, &sample), "write");
    }
  }
  check(dds_wait_for_acks(writer, DDS_SECS(60)), "acknowledgments");
  dds_delete(participant);
  return 0;
}
