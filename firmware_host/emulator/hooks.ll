; What runs far too often for Python: the engine calls these functions, and they ask Python only where there is more to
; do. `hooks.py` translates them for the machine at hand when the emulator starts and says what the structures mean;
; those here are the same, field by field. LLVM's language: https://llvm.org/docs/LangRef.html

%Time = type { i64, i64 }                                 ; now, deadline
%Meter = type { ptr, ptr, i64, i64, ptr }                 ; ask, time, first address, halfwords, ticks of each
%Watch = type { ptr, ptr, i64, i64, i64 }                ; read, ask, register, times, enough
%Shortcuts = type { ptr, ptr, ptr, ptr, ptr, ptr }        ; read, write, exchange, time, counter, bus
%Counter = type { i64, i64, i64, i64, i64, i64, i64, i64 } ; clocked, since, counted, counts, ticks, modulus, read at, polls
%Bus = type { i64, i64, i64, i64, i64, i64, i64, [2 x i64], [2 x i64], i64, i64, i64, i64, i64, [16 x i16] }
                                     ; clocked, speaks, free, pair, half a bit, polled, waiting, ready, answers, control,
                                     ; setups, known in which, known from, known to, known

; --- before each block of instructions: let its ticks pass

define void @block(ptr %engine, i64 %address, i32 %size, ptr %meter) {
  %time_at = getelementptr %Meter, ptr %meter, i32 0, i32 1
  %time = load ptr, ptr %time_at
  %now = load i64, ptr %time
  %deadline_at = getelementptr %Time, ptr %time, i32 0, i32 1
  %deadline = load i64, ptr %deadline_at
  %due = icmp sge i64 %now, %deadline
  br i1 %due, label %ask, label %find

find:
  %first_at = getelementptr %Meter, ptr %meter, i32 0, i32 2
  %first = load i64, ptr %first_at
  %offset = sub i64 %address, %first
  %index = lshr i64 %offset, 1
  %length_at = getelementptr %Meter, ptr %meter, i32 0, i32 3
  %length = load i64, ptr %length_at
  %inside = icmp ult i64 %index, %length
  br i1 %inside, label %look, label %ask

look:
  %ticks_at = getelementptr %Meter, ptr %meter, i32 0, i32 4
  %ticks = load ptr, ptr %ticks_at
  %cost_at = getelementptr i32, ptr %ticks, i64 %index
  %cost = load i32, ptr %cost_at
  %known = icmp ne i32 %cost, 0
  br i1 %known, label %pass, label %ask

pass:
  %taken = zext i32 %cost to i64
  %then = add i64 %now, %taken
  store i64 %then, ptr %time
  ret void

ask:
  %python = load ptr, ptr %meter
  call void %python(ptr %engine, i64 %address, i32 %size)
  ret void
}

; --- before an instruction whose base register has to be a multiple of four: ask where it is not, and once when it was
; --- often enough

define void @watch(ptr %engine, i64 %address, i32 %size, ptr %watch) {
  %base_at = alloca i32
  %register_at = getelementptr %Watch, ptr %watch, i32 0, i32 2
  %register_wide = load i64, ptr %register_at
  %register = trunc i64 %register_wide to i32
  %read = load ptr, ptr %watch
  %status = call i32 %read(ptr %engine, i32 %register, ptr %base_at)
  %base = load i32, ptr %base_at
  %odd = and i32 %base, 3
  %aligned = icmp eq i32 %odd, 0
  br i1 %aligned, label %count, label %ask

count:
  %times_at = getelementptr %Watch, ptr %watch, i32 0, i32 3
  %enough_at = getelementptr %Watch, ptr %watch, i32 0, i32 4
  %times = load i64, ptr %times_at
  %more = add i64 %times, 1
  store i64 %more, ptr %times_at
  %enough = load i64, ptr %enough_at
  %trusted = icmp eq i64 %more, %enough
  br i1 %trusted, label %ask, label %done

ask:
  %python_at = getelementptr %Watch, ptr %watch, i32 0, i32 1
  %python = load ptr, ptr %python_at
  call void %python(ptr %engine, i64 %address, i32 %size)
  br label %done

done:
  ret void
}

; --- a poll: let time pass until `tick`, but not beyond the deadline

define internal void @wait_until(ptr %time, i64 %tick) {
  %now = load i64, ptr %time
  %deadline_at = getelementptr %Time, ptr %time, i32 0, i32 1
  %deadline = load i64, ptr %deadline_at
  %until = call i64 @llvm.smin.i64(i64 %tick, i64 %deadline)
  %then = call i64 @llvm.smax.i64(i64 %now, i64 %until)
  store i64 %then, ptr %time
  ret void
}

; --- reads of the peripherals: the counter and the bus by themselves, the others by Python

define i64 @read(ptr %engine, i64 %offset, i32 %size, ptr %shortcuts) {
  %time_at = getelementptr %Shortcuts, ptr %shortcuts, i32 0, i32 3
  %counter_at = getelementptr %Shortcuts, ptr %shortcuts, i32 0, i32 4
  %bus_at = getelementptr %Shortcuts, ptr %shortcuts, i32 0, i32 5
  %time = load ptr, ptr %time_at
  %counter = load ptr, ptr %counter_at
  %bus = load ptr, ptr %bus_at
  %wide_offset = shl i64 %offset, 3
  %width = zext i32 %size to i64
  %access = or i64 %wide_offset, %width
  switch i64 %access, label %ask [
    i64 292, label %count      ; TIM2 CNT, 0x24: four bytes
    i64 622596, label %control ; SPI1 CR1, 0x13000: four bytes
    i64 622660, label %status  ; SPI1 SR, 0x13008: four bytes
    i64 622690, label %data    ; SPI1 DR, 0x1300C: two bytes
  ]

count:
  %counter_clocked = load i64, ptr %counter
  %counter_on = icmp ne i64 %counter_clocked, 0
  br i1 %counter_on, label %counter_count, label %ask
counter_count:
  %counted = call i64 @read_count(ptr %counter, ptr %time)
  ret i64 %counted

control:
  %control_clocked = load i64, ptr %bus
  %control_on = icmp ne i64 %control_clocked, 0
  br i1 %control_on, label %bus_control, label %ask
bus_control:
  %control_at = getelementptr %Bus, ptr %bus, i32 0, i32 9
  %control_value = load i64, ptr %control_at
  ret i64 %control_value

status:
  %clocked = load i64, ptr %bus
  %bus_on = icmp ne i64 %clocked, 0
  br i1 %bus_on, label %bus_status, label %ask
bus_status:
  %flags = call i64 @read_status(ptr %bus, ptr %time)
  ret i64 %flags

data:
  %data_clocked = load i64, ptr %bus
  %data_on = icmp ne i64 %data_clocked, 0
  %has_come = call i1 @has_come(ptr %bus, ptr %time)
  %readable = and i1 %data_on, %has_come
  br i1 %readable, label %take, label %ask
take:
  %pair = call i64 @take(ptr %bus)
  ret i64 %pair

ask:
  %python = load ptr, ptr %shortcuts
  %answer = call i64 %python(ptr %engine, i64 %offset, i32 %size)
  ret i64 %answer
}

; --- writes to the peripherals: pairs of bytes go to the bus, which answers, and setting it up as it is does nothing;
; --- all else is for Python

define void @write(ptr %engine, i64 %offset, i32 %size, i64 %value, ptr %shortcuts) {
  %time_at = getelementptr %Shortcuts, ptr %shortcuts, i32 0, i32 3
  %bus_at = getelementptr %Shortcuts, ptr %shortcuts, i32 0, i32 5
  %time = load ptr, ptr %time_at
  %bus = load ptr, ptr %bus_at
  %clocked = load i64, ptr %bus
  %speaks_at = getelementptr %Bus, ptr %bus, i32 0, i32 1
  %waiting_at = getelementptr %Bus, ptr %bus, i32 0, i32 6
  %speaks = load i64, ptr %speaks_at
  %waiting = load i64, ptr %waiting_at
  %wide_offset = shl i64 %offset, 3
  %width = zext i32 %size to i64
  %access = or i64 %wide_offset, %width
  %is_data = icmp eq i64 %access, 622690 ; SPI1 DR, 0x1300C: two bytes
  %is_clocked = icmp ne i64 %clocked, 0
  %is_set_up = icmp ne i64 %speaks, 0
  %has_room = icmp ult i64 %waiting, 2
  %one = and i1 %is_data, %is_clocked
  %two = and i1 %is_set_up, %has_room
  %goes = and i1 %one, %two
  br i1 %goes, label %speak, label %set_up

set_up:
  %free_now_at = getelementptr %Bus, ptr %bus, i32 0, i32 2
  %control_at = getelementptr %Bus, ptr %bus, i32 0, i32 9
  %free_now = load i64, ptr %free_now_at
  %control = load i64, ptr %control_at
  %looked = load i64, ptr %time
  %is_control = icmp eq i64 %access, 622596 ; SPI1 CR1, 0x13000: four bytes
  %is_same = icmp eq i64 %value, %control
  %is_quiet = icmp sle i64 %free_now, %looked
  %three = and i1 %is_control, %is_clocked
  %four = and i1 %is_same, %is_quiet
  %nothing = and i1 %three, %four
  br i1 %nothing, label %done, label %ask
done:
  ret void

speak:                               ; what the part will say is known, and nothing is due before
  %deadline_at = getelementptr %Time, ptr %time, i32 0, i32 1
  %setups_at = getelementptr %Bus, ptr %bus, i32 0, i32 10
  %known_in_at = getelementptr %Bus, ptr %bus, i32 0, i32 11
  %from_at = getelementptr %Bus, ptr %bus, i32 0, i32 12
  %to_at = getelementptr %Bus, ptr %bus, i32 0, i32 13
  %deadline = load i64, ptr %deadline_at
  %spoken = load i64, ptr %time
  %setups = load i64, ptr %setups_at
  %known_in = load i64, ptr %known_in_at
  %from = load i64, ptr %from_at
  %to = load i64, ptr %to_at
  %early = icmp slt i64 %spoken, %deadline
  %unchanged = icmp eq i64 %setups, %known_in
  %left = icmp slt i64 %from, %to
  %five = and i1 %early, %unchanged
  %known = and i1 %five, %left
  br i1 %known, label %say, label %exchange

say:
  %said_at = getelementptr %Bus, ptr %bus, i32 0, i32 14, i64 %from
  %said_short = load i16, ptr %said_at
  %said = zext i16 %said_short to i64
  %next = add i64 %from, 1
  store i64 %next, ptr %from_at
  br label %hear

exchange:
  %exchange_at = getelementptr %Shortcuts, ptr %shortcuts, i32 0, i32 2
  %python_exchange = load ptr, ptr %exchange_at
  %exchanged = call i64 %python_exchange(i64 %value)
  br label %hear

hear:
  %answer = phi i64 [ %said, %say ], [ %exchanged, %exchange ]
  %free_at = getelementptr %Bus, ptr %bus, i32 0, i32 2
  %pair_at = getelementptr %Bus, ptr %bus, i32 0, i32 3
  %half_at = getelementptr %Bus, ptr %bus, i32 0, i32 4
  %polled_at = getelementptr %Bus, ptr %bus, i32 0, i32 5
  %ready_at = getelementptr %Bus, ptr %bus, i32 0, i32 7, i64 %waiting
  %answer_at = getelementptr %Bus, ptr %bus, i32 0, i32 8, i64 %waiting
  %free = load i64, ptr %free_at
  %pair = load i64, ptr %pair_at
  %half = load i64, ptr %half_at
  %now = load i64, ptr %time
  %begins = call i64 @llvm.smax.i64(i64 %now, i64 %free)
  %ends = add i64 %begins, %pair
  %ready = sub i64 %ends, %half      ; a bit is taken in its middle
  %more = add i64 %waiting, 1
  store i64 %ends, ptr %free_at
  store i64 %ready, ptr %ready_at
  store i64 %answer, ptr %answer_at
  store i64 %more, ptr %waiting_at
  store i64 0, ptr %polled_at
  ret void

ask:
  %python_at = getelementptr %Shortcuts, ptr %shortcuts, i32 0, i32 1
  %python = load ptr, ptr %python_at
  call void %python(ptr %engine, i64 %offset, i32 %size, i64 %value)
  ret void
}

; --- TIM2. Who reads it again and again waits for the next count, and so do we, instead of counting his turns

define i64 @read_count(ptr %counter, ptr %time) {
  %since_at = getelementptr %Counter, ptr %counter, i32 0, i32 1
  %counted_at = getelementptr %Counter, ptr %counter, i32 0, i32 2
  %counts_at = getelementptr %Counter, ptr %counter, i32 0, i32 3
  %ticks_at = getelementptr %Counter, ptr %counter, i32 0, i32 4
  %modulus_at = getelementptr %Counter, ptr %counter, i32 0, i32 5
  %read_at = getelementptr %Counter, ptr %counter, i32 0, i32 6
  %polls_at = getelementptr %Counter, ptr %counter, i32 0, i32 7
  %since = load i64, ptr %since_at
  %counted = load i64, ptr %counted_at
  %counts = load i64, ptr %counts_at
  %ticks = load i64, ptr %ticks_at
  %modulus = load i64, ptr %modulus_at
  %now = load i64, ptr %time
  %last = load i64, ptr %read_at
  %pause = sub i64 %now, %last
  %again = icmp slt i64 %pause, 40
  %polls_before = load i64, ptr %polls_at
  %one_more = add i64 %polls_before, 1
  %polls = select i1 %again, i64 %one_more, i64 0
  store i64 %polls, ptr %polls_at
  %many = icmp sgt i64 %polls, 3
  %runs = icmp ne i64 %counts, 0
  %waits = and i1 %many, %runs
  br i1 %waits, label %wait, label %count

wait:
  %ran = sub i64 %now, %since
  %scaled = mul i64 %ran, %counts
  %whole = udiv i64 %scaled, %ticks
  %next = add i64 %whole, 1
  %next_scaled = mul i64 %next, %ticks
  %rounding = sub i64 %counts, 1
  %rounded = add i64 %next_scaled, %rounding
  %way = udiv i64 %rounded, %counts
  %tick = add i64 %since, %way
  call void @wait_until(ptr %time, i64 %tick)
  br label %count

count:
  %then = load i64, ptr %time
  store i64 %then, ptr %read_at
  %run = sub i64 %then, %since
  %run_scaled = mul i64 %run, %counts
  %more = udiv i64 %run_scaled, %ticks
  %total = add i64 %counted, %more
  %value = urem i64 %total, %modulus
  ret i64 %value
}

; --- SPI1. Who looks twice in vain waits for what is on the bus

define i64 @read_status(ptr %bus, ptr %time) {
  %free_at = getelementptr %Bus, ptr %bus, i32 0, i32 2
  %pair_at = getelementptr %Bus, ptr %bus, i32 0, i32 3
  %polled_at = getelementptr %Bus, ptr %bus, i32 0, i32 5
  %waiting_at = getelementptr %Bus, ptr %bus, i32 0, i32 6
  %ready_at = getelementptr %Bus, ptr %bus, i32 0, i32 7
  %free = load i64, ptr %free_at
  %waiting = load i64, ptr %waiting_at
  %ready = load i64, ptr %ready_at
  %some = icmp ne i64 %waiting, 0
  %awaited = select i1 %some, i64 %ready, i64 %free
  %looked = load i64, ptr %time
  %early = icmp sgt i64 %awaited, %looked
  br i1 %early, label %poll, label %answer

poll:
  %polled = load i64, ptr %polled_at
  store i64 1, ptr %polled_at
  %again = icmp ne i64 %polled, 0
  br i1 %again, label %wait, label %answer

wait:
  call void @wait_until(ptr %time, i64 %awaited)
  br label %answer

answer:
  %now = load i64, ptr %time
  %busy = icmp sgt i64 %free, %now
  %busy_flag = select i1 %busy, i64 128, i64 0
  %come = icmp sle i64 %ready, %now
  %received = and i1 %some, %come
  %received_flag = zext i1 %received to i64
  %left = sub i64 %free, %now
  %pair = load i64, ptr %pair_at
  %room = icmp sle i64 %left, %pair
  %room_flag = select i1 %room, i64 2, i64 0
  %two = or i64 %busy_flag, %received_flag
  %flags = or i64 %two, %room_flag
  ret i64 %flags
}

define internal i1 @has_come(ptr %bus, ptr %time) {
  %waiting_at = getelementptr %Bus, ptr %bus, i32 0, i32 6
  %ready_at = getelementptr %Bus, ptr %bus, i32 0, i32 7
  %waiting = load i64, ptr %waiting_at
  %ready = load i64, ptr %ready_at
  %now = load i64, ptr %time
  %some = icmp ne i64 %waiting, 0
  %come = icmp sle i64 %ready, %now
  %both = and i1 %some, %come
  ret i1 %both
}

define internal i64 @take(ptr %bus) {
  %polled_at = getelementptr %Bus, ptr %bus, i32 0, i32 5
  %waiting_at = getelementptr %Bus, ptr %bus, i32 0, i32 6
  %ready_at = getelementptr %Bus, ptr %bus, i32 0, i32 7
  %ready_next_at = getelementptr %Bus, ptr %bus, i32 0, i32 7, i32 1
  %answer_at = getelementptr %Bus, ptr %bus, i32 0, i32 8
  %answer_next_at = getelementptr %Bus, ptr %bus, i32 0, i32 8, i32 1
  %answer = load i64, ptr %answer_at
  %waiting = load i64, ptr %waiting_at
  %left = sub i64 %waiting, 1
  %ready_next = load i64, ptr %ready_next_at
  %answer_next = load i64, ptr %answer_next_at
  store i64 0, ptr %polled_at
  store i64 %left, ptr %waiting_at
  store i64 %ready_next, ptr %ready_at
  store i64 %answer_next, ptr %answer_at
  ret i64 %answer
}

declare i64 @llvm.smin.i64(i64, i64)
declare i64 @llvm.smax.i64(i64, i64)
